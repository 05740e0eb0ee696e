"""Names of missions, which are valid file names on any system; and file names instead of paths."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from m2pem.api import Finding

SUFFIX = ".bpmn"
LONGEST = 100
LONGEST_BYTES = 200
"""Longest name: file systems allow 255 bytes, with the suffix and that of a temporary file."""

_SIGNS = r"\x3a-\x40\x5b-\x5e\x60\x7b-\x7f"
PATTERN = rf"^[^\x00-\x2c\x2e\x2f{_SIGNS}][^\x00-\x1f\x21-\x2c\x2f{_SIGNS}]*$"
"""A name has letters, digits, - _ . and spaces; the first character is no point and no space.

The pattern lists what it excludes: regular expressions differ about letters outside ASCII.
"""

_NAME = re.compile(r"[\w\-][\w\-. ]*")
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


def why_not(name: str) -> str:
    """Return what is wrong with a name; "" if it is allowed."""
    if not name or len(name) > LONGEST or len(name.encode("utf-8", "replace")) > LONGEST_BYTES:
        return f"a name has 1 to {LONGEST} letters"
    if _NAME.fullmatch(name) is None:
        return "a name has letters, digits, - _ . and spaces, and begins with no point or space"
    if name.endswith((" ", ".")) or unicodedata.normalize("NFC", name) != name:
        return "a name does not end with a point or a space"
    if name.lower().endswith(SUFFIX):
        return f"a name is written without {SUFFIX}"
    if _DEVICES.fullmatch(name):
        return "Windows has a device of that name"
    return ""


_FOLDERS = re.compile(r"""(?<![\w:/.])/(?:[^/\s:'",;()]+/)+(?=[^/\s:'",;()])""")
"""Matches the folders of absolute paths, but not of URLs."""


class PathNames:
    """Replaces paths in texts for browsers by file names. `folder`: of the missions."""

    def __init__(self, folder: Path) -> None:
        self._folders = sorted({f"{folder.resolve()}/", f"{folder}/"}, key=len, reverse=True)

    def text(self, text: str) -> str:
        """Return a text with file names instead of paths."""
        for folder in self._folders:
            if folder not in ("/", "./"):
                text = text.replace(folder, "")
        return _FOLDERS.sub("", text)

    def findings(self, findings: Iterable[object]) -> tuple[Finding, ...]:
        """Return findings with file names instead of paths."""
        return tuple(
            replace(
                each,
                file=self.text(each.file),
                message=self.text(each.message),
                remedy=self.text(each.remedy),
            )
            for each in findings
            if isinstance(each, Finding)
        )
