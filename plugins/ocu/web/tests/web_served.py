"""`m2pem serve --ocu web` as a process of its own, as people start it."""

import os
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from tests.preloaded import Process, preloaded

REPOSITORY = Path(__file__).parents[4]
FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"
ENDS_WITHIN_S = 30

_URL = re.compile(r"https?://\S+")


@dataclass(slots=True)
class Served:
    """An executive with a page. `url`: what it printed, with the token that works once."""

    process: Process
    url: str
    missions: Path
    printed: list[str]

    @property
    def origin(self) -> str:
        """Of the page: scheme, host and port."""
        parts = urlsplit(self.url)
        return f"{parts.scheme}://{parts.netloc}"

    def end(self) -> int:
        """Ctrl-C, so to say; what the process ended with."""
        self.process.terminate()
        return self.process.wait(ENDS_WITHIN_S)


@contextmanager
def served(
    folder: Path,
    *,
    fleet: Path = FLEET,
    words: Sequence[str] = ("--simulate", "--speed", "1", "--journal", "memory:"),
    environment: Mapping[str, str] | None = None,
) -> Iterator[Served]:
    """Start it, with its missions in `folder`/missions, and end it."""
    missions = folder / "missions"
    missions.mkdir(exist_ok=True)
    variables = {
        **os.environ,
        "M2PEM_OPERATOR": "anna",
        "M2PEM_WEB_PORT": "0",
        "M2PEM_WEB_MISSIONS": str(missions),
        **(environment or {}),
    }
    command = ["serve", "--fleet", str(fleet), "--ocu", "web", *words]
    output, theirs = os.pipe()
    with Path(os.devnull).open() as nothing:
        process = preloaded().start(command, folder, variables, (nothing.fileno(), theirs, theirs))
    os.close(theirs)
    printed: list[str] = []
    said = threading.Event()

    def read() -> None:
        with os.fdopen(output) as lines:
            for line in lines:
                printed.append(line)
                if _URL.search(line):
                    said.set()
        said.set()

    reading = threading.Thread(target=read, daemon=True)
    reading.start()
    try:
        said.wait()  # for its address or its end: a busy machine may take minutes
        urls = _URL.findall("".join(printed))
        assert urls, "".join(printed)
        yield Served(process, urls[0], missions, printed)
    finally:
        process.kill()
        process.wait()
        reading.join()
