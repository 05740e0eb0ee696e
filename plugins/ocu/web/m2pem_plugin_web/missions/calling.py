"""What files are called when browsers are told of them: by their names, without their folders."""

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from m2pem.api import Finding

_FOLDERS = re.compile(r"""(?<![\w:/.])/(?:[^/\s:'",;()]+/)+(?=[^/\s:'",;()])""")
"""Of absolute paths; a URL has none."""


class Called:
    """`folder`: of missions. Where it is, and where others are, is no browser's business."""

    def __init__(self, folder: Path) -> None:
        self._folders = sorted({f"{folder.resolve()}/", f"{folder}/"}, key=len, reverse=True)

    def text(self, text: str) -> str:
        """A text for people, with names instead of paths."""
        for folder in self._folders:
            if folder not in ("/", "./"):
                text = text.replace(folder, "")
        return _FOLDERS.sub("", text)

    def findings(self, findings: Iterable[object]) -> tuple[Finding, ...]:
        """Findings that name files in the same way."""
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
