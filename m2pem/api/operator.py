"""Who asks: the name that the journal keeps of an operator."""

import getpass
import os
import socket

VARIABLE = "M2PEM_OPERATOR"
"""The environment variable for operators who share an account."""


MAX_CHARACTERS = 200


def one_line(name: str) -> str:
    """Return the name of an operator as journals keep it: without control characters, and not too
    long. It is never refused: it may come with a STOP."""
    return "".join(each if each.isprintable() else " " for each in name[:MAX_CHARACTERS]).strip()


def operator_name() -> str:
    """Return M2PEM_OPERATOR, else the user and the host of this process, as "anna@gcs1"."""
    if named := one_line(os.environ.get(VARIABLE, "")):
        return named
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = "operator"
    return f"{user}@{socket.gethostname().partition('.')[0]}"
