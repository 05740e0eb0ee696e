"""Names for PROMELA: of places and variables, and comments that say what they are."""

import re
from collections.abc import Iterable

_MARKS = {"!": "_active", ">": "_waiting", "~": "_", "/": "_"}
_LONGEST = 60


def identifiers(prefix: str, names: Iterable[str]) -> list[str]:
    """An identifier for each name, all different.

    The prefix keeps them apart from words of PROMELA and of C, which Spin writes them into.
    """
    found: list[str] = []
    used: set[str] = set()
    for name in names:
        plain = "".join(_MARKS.get(each, each) for each in name)
        plain = prefix + re.sub(r"[^A-Za-z0-9_]", "_", plain)[:_LONGEST]
        unique, number = plain, 1
        while unique in used:
            number += 1
            unique = f"{plain}_{number}"
        used.add(unique)
        found.append(unique)
    return found


def comment(text: str) -> str:
    """A text as a comment of one line; what would end the comment, or mean more in C, is spaced."""
    line = " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("\\", "\\ ")
    return f"/* {line} */"
