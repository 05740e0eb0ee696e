"""What missions may be called: names that are a file's on any system, and never a path."""

import re
import unicodedata

SUFFIX = ".bpmn"
LONGEST = 100
LONGEST_BYTES = 200
"""File systems count bytes: 255 at most, with the suffix and what is added for a moment."""

PATTERN = r"^[\w\-][\w\-. ]*$"
"""Letters, digits, - _ . and spaces; the first is no point and no space."""

_NAME = re.compile(PATTERN)
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


def why_not(name: str) -> str:
    """What is wrong with a name; "" if it will do."""
    if not name or len(name) > LONGEST or len(name.encode("utf-8", "replace")) > LONGEST_BYTES:
        return f"a name has 1 to {LONGEST} letters"
    if _NAME.fullmatch(name) is None or "\n" in name:
        return "a name has letters, digits, - _ . and spaces, and begins with none of the last two"
    if name.endswith((" ", ".")) or unicodedata.normalize("NFC", name) != name:
        return "a name does not end with a point or a space"
    if name.lower().endswith(SUFFIX):
        return f"a name is written without {SUFFIX}"
    if _DEVICES.fullmatch(name):
        return "some systems have a device of that name"
    return ""
