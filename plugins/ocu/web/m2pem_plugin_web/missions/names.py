"""What missions may be called: names that are a file's on any system, and never a path."""

import re
import unicodedata

SUFFIX = ".bpmn"
LONGEST = 100
LONGEST_BYTES = 200
"""File systems count bytes: 255 at most, with the suffix and what is added for a moment."""

_SIGNS = r"\x3a-\x40\x5b-\x5e\x60\x7b-\x7f"
PATTERN = rf"^[^\x00-\x2c\x2e\x2f{_SIGNS}][^\x00-\x1f\x21-\x2c\x2f{_SIGNS}]*$"
"""Of ASCII, letters, digits, - _ . and spaces; the first is no point and no space.

It says what is left out: what a letter is beyond ASCII is not the same in all regular expressions.
"""

_NAME = re.compile(r"[\w\-][\w\-. ]*")
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


def why_not(name: str) -> str:
    """What is wrong with a name; "" if it will do."""
    if not name or len(name) > LONGEST or len(name.encode("utf-8", "replace")) > LONGEST_BYTES:
        return f"a name has 1 to {LONGEST} letters"
    if _NAME.fullmatch(name) is None:
        return "a name has letters, digits, - _ . and spaces, and begins with none of the last two"
    if name.endswith((" ", ".")) or unicodedata.normalize("NFC", name) != name:
        return "a name does not end with a point or a space"
    if name.lower().endswith(SUFFIX):
        return f"a name is written without {SUFFIX}"
    if _DEVICES.fullmatch(name):
        return "some systems have a device of that name"
    return ""
