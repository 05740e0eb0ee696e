"""Texts of requests, and texts for messages of ROS."""

from m2pem.api import MAX_NAME_CHARACTERS
from m2pem.errors import OperatorError


def sendable(text: str) -> str:
    """The text as a message can carry it: without NUL, at which it would end for its reader, and
    without halves of surrogate pairs, which are no Unicode."""
    return text.replace("\0", "\N{REPLACEMENT CHARACTER}").encode(errors="replace").decode()


def one_line(text: str) -> str:
    """The text on one line, without what would steer a terminal: it may come from anywhere."""
    line = " ".join(text.split())
    return sendable("".join(each if each.isprintable() else "?" for each in line))


def named(text: str, field: str, example: str) -> str:
    """A name that a request must give.

    Raises:
        OperatorError: it is empty, or too long.
    """
    if not text.strip():
        raise OperatorError(f"{field} is empty: say which, for example {example}")
    return bounded(text, field, MAX_NAME_CHARACTERS)


def bounded(text: str, field: str, characters: int) -> str:
    """A text of a request.

    Raises:
        OperatorError: it is too long.
    """
    if len(text) > characters:
        raise OperatorError(
            f"{field} has {len(text):,} characters; {characters:,} are the most that it may have"
        )
    return text


def asker(by: str, nameless: str) -> str:
    """Who asks, for the journal; `nameless` if the request does not say.

    Raises:
        OperatorError: the name is too long.
    """
    return one_line(bounded(by, "by", MAX_NAME_CHARACTERS)) or nameless
