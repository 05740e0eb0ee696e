"""The machine of an author who never met us: a folder, a clean environment, pip, and nothing else.

There is no package index there. What m2pem says that it needs, and what authors install themselves,
is lent from the environment that runs the tests; nothing else is, so that a dependency which m2pem
fails to declare is missing.
"""

import importlib.metadata
import os
import re
import shlex
import socket
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from packaging.requirements import Requirement

REPOSITORY = Path(__file__).parents[2]
INSTALLED_BY_AUTHORS = ("pytest",)
BUILD_BACKEND = ("hatchling", "editables")
OWN = re.compile(r"m2pem($|[-_.])")


def build_wheel(folder: Path) -> Path:
    """A wheel of m2pem as it is released."""
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index"]
    command += ["--no-build-isolation", "--wheel-dir", str(folder), str(REPOSITORY)]
    subprocess.run(command, check=True, env=offline())
    (wheel,) = folder.glob("m2pem-*.whl")
    return wheel


def offline() -> dict[str, str]:
    """An environment in which pip has no index, and knows nothing of this machine's settings."""
    kept = {name: os.environ[name] for name in ("PATH", "LANG") if name in os.environ}
    return {**kept, "PIP_NO_INDEX": "1", "PIP_CONFIG_FILE": os.devnull}


@dataclass
class Author:
    """An author in `folder`, with the virtual environment `folder/.venv`."""

    folder: Path
    wheel: Path
    running: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def environment(self) -> dict[str, str]:
        home = self.folder / "home"
        home.mkdir(exist_ok=True)
        return {
            **offline(),
            "HOME": str(home),
            "PATH": os.pathsep.join([str(self.folder / ".venv" / "bin"), os.environ["PATH"]]),
            "PIP_FIND_LINKS": str(self.wheel.parent),
            # pip's own spelling of --no-build-isolation: the backend is lent, too.
            "PIP_NO_BUILD_ISOLATION": "0",
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        }

    def do(self, text: str) -> subprocess.CompletedProcess[str]:
        """Type a command. One that ends with `&` goes on until `leave`."""
        if text.endswith("&"):
            self.running.append(self._start(text.removesuffix("&").strip()))
            return subprocess.CompletedProcess(text, 0, "")
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", text],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=300,
            check=False,
        )
        if "-m venv .venv" in text and done.returncode == 0:
            lend(self.folder / ".venv", [*INSTALLED_BY_AUTHORS, *BUILD_BACKEND])
        return done

    def leave(self) -> None:
        """End what was left running."""
        for process in self.running:
            process.kill()
            process.wait()

    def _start(self, text: str) -> subprocess.Popen[bytes]:
        command, _, log = text.partition(">")
        with (self.folder / (log.strip() or os.devnull)).open("w") as output:
            return subprocess.Popen(
                shlex.split(command), cwd=self.folder, env=self.environment, stdout=output
            )


def lend(environment: Path, names: Sequence[str]) -> None:
    """Link into an environment what m2pem requires and `names`, with all that these require."""
    (target,) = environment.glob("lib/python*/site-packages")
    for entry in needed(["m2pem", *names]):
        if not (target / entry.name).exists():
            (target / entry.name).symlink_to(entry)


def needed(names: Sequence[str]) -> Iterator[Path]:
    """The files and folders of distributions, and of those that they require; m2pem's are not."""
    wanted, seen = list(names), set()
    while wanted:
        name = wanted.pop().lower().replace("_", "-")
        if name in seen:
            continue
        seen.add(name)
        try:
            distribution = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # for another platform
        for text in distribution.requires or ():
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                wanted.append(requirement.name)
        if not OWN.match(name):
            yield from entries(distribution)


def entries(distribution: importlib.metadata.Distribution) -> set[Path]:
    """What a distribution has at the top of the environment's packages."""
    tops = {file.parts[0] for file in distribution.files or () if file.parts[0] != ".."}
    tops -= {"__pycache__"}
    roots = {Path(sysconfig.get_path(name)) for name in ("purelib", "platlib")}
    return {root / top for root in roots for top in tops if (root / top).exists()}


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
