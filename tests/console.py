"""Console blocks of Markdown pages: their commands are run, their output is compared.

In a `console` block, a line that starts with `$ ` is a command and what follows it is its output,
in which `...` stands for anything (alone on a line: for any lines). A block without `$ ` has only
commands. A comment says what is special: `# exit 1`, or `# interactive` for a command that needs a
person or never ends; of that one only the options are checked. `# leave it running` is a command of
another terminal: `follow` runs a page from its first command to its last, as its reader does.
"""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from tempfile import TemporaryFile

from tests.preloaded import preloaded

REPOSITORY = Path(__file__).parents[1]
WHAT_COMMANDS_READ = (
    *("missions", "fleet_configs", "examples", "docs/broken", "docs/tutorials/patrol"),
)
INSTALLING = frozenset({"make", "pip", "python3", "source"})
"""Commands of a page that `follow` leaves out: the environment of the tests is what they make."""
FOR_A_SHELL = frozenset("|&;<>()$`*?[]{}~!")
BOUND_S = 100


@dataclass(frozen=True, slots=True)
class Command:
    """One command of a console block, with what the page says that it prints and ends with."""

    text: str
    output: tuple[str, ...] = ()

    @property
    def program(self) -> str:
        return self.text.split()[0]

    @property
    def status(self) -> int:
        said = re.search(r"# exit (\d+)$", self.text)
        return int(said[1]) if said else 0

    @property
    def interactive(self) -> bool:
        return self.text.endswith("# interactive")

    @property
    def left_running(self) -> bool:
        return self.text.endswith("# leave it running")


def read_block(block: str) -> tuple[Command, ...]:
    lines = block.replace("\\\n", " ").splitlines()
    if not any(line.startswith("$ ") for line in lines):
        lines = [f"$ {line}" for line in lines if line.strip()]
    commands: list[Command] = []
    for line in lines:
        if line.startswith("$ "):
            commands.append(Command(" ".join(line[2:].split())))
        else:
            commands[-1] = Command(commands[-1].text, (*commands[-1].output, line))
    return tuple(commands)


def blocks(page: Path) -> Iterator[tuple[int, tuple[Command, ...]]]:
    """The console blocks of a page, each with its line."""
    text = page.read_text(encoding="utf-8")
    for fence in re.finditer(r"^```console\n(.*?)^```$", text, re.M | re.S):
        yield text.count("\n", 0, fence.start()) + 1, read_block(fence[1])


def first_unprinted(expected: tuple[str, ...], printed: str) -> str | None:
    """The first expected line that is not where it should be, or None if all are there."""
    lines = iter(printed.rstrip().splitlines())
    skipping = False
    for line in expected:
        if line.strip() == "...":
            skipping = True
            continue
        pattern = re.compile(".*".join(re.escape(part) for part in line.rstrip().split("...")))
        found = (pattern.fullmatch(actual.rstrip()) for actual in lines)
        if not (any(found) if skipping else next(found, None)):
            return line
        skipping = False
    return None if skipping or next(lines, None) is None else "(the end of the output)"


def environment(home: Path) -> dict[str, str]:
    """An empty home, and the m2pem of the environment that runs the tests first on the path."""
    home.mkdir()
    here = {name: value for name, value in os.environ.items() if not name.startswith("XDG_")}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return {**here, "HOME": str(home), "PATH": path, "PYTHONPATH": str(REPOSITORY)}


def make_workspace(folder: Path) -> Path:
    """A copy of what the commands read, in which they may write."""
    folder.mkdir()
    for name in WHAT_COMMANDS_READ:
        if (REPOSITORY / name).is_dir():
            shutil.copytree(
                REPOSITORY / name, folder / name, ignore=shutil.ignore_patterns("__pycache__")
            )
    return folder


def run(
    text: str, folder: Path, environment: Mapping[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run a command in a shell, or without one where it is the m2pem of the tests and no more."""
    if (words := _words_of_m2pem(text, environment)) is None:
        return subprocess.run(
            ["bash", "-o", "pipefail", "-c", text],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=BOUND_S,
            check=False,
        )
    return run_preloaded(words, folder, environment)


def run_preloaded(
    words: list[str], folder: Path, environment: Mapping[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run `m2pem WORDS`, or Python code, as `Preloaded.start` does."""
    with Path(os.devnull).open() as nothing, TemporaryFile("w+") as said:
        streams = nothing.fileno(), said.fileno(), said.fileno()
        process = preloaded().start(words, folder, environment, streams)
        try:
            status = process.wait(BOUND_S)
        finally:
            process.kill()
        said.seek(0)
        return subprocess.CompletedProcess(words, status, said.read())


def _words_of_m2pem(text: str, environment: Mapping[str, str]) -> list[str] | None:
    program, *words = shlex.split(text, comments=True)
    found = shutil.which(program, path=environment["PATH"])
    ours = program == "m2pem" and found == str(Path(sys.executable).with_name("m2pem"))
    return words if ours and not FOR_A_SHELL & set(text.partition(" # ")[0]) else None


def assert_does_what_is_shown(
    command: Command, workspace: Path, environment: Mapping[str, str]
) -> None:
    """Run a command and compare status and output; of an interactive one, look at the options."""
    if command.interactive:
        words = shlex.split(command.text, comments=True)
        named = takewhile(lambda word: not word.startswith("-"), words)
        usage = run(shlex.join([*named, "--help"]), workspace, environment)
        assert usage.returncode == 0, usage.stdout
        options = [word.split("=")[0] for word in words if word.startswith("--")]
        assert [option for option in options if option not in usage.stdout] == []
        return
    done = run(command.text, workspace, environment)
    assert done.returncode == command.status, f"{command.text}\n{done.stdout}"
    if command.output:
        missing = first_unprinted(command.output, done.stdout)
        assert missing is None, f"{command.text}\n{done.stdout}\nnot as shown: {missing}"


def follow(
    page: Path,
    workspace: Path,
    environment: Mapping[str, str],
    replaced: Mapping[str, str] | None = None,
) -> None:
    """Do what a page says in its order: save the blocks that have a title, run the commands.

    `replaced` has texts of the page, such as a port, and what is used in their place here.
    Programs that are left running get what a terminal sends for Ctrl-C when the page has ended.
    """
    folder = workspace
    block_or_file = re.compile(r'^```(console|\w+ title="([^"]+)")\n(.*?)^```$', re.M | re.S)
    text = page.read_text(encoding="utf-8")
    for old, new in (replaced or {}).items():
        text = text.replace(old, new)
    with ExitStack() as running:
        for kind, title, content in block_or_file.findall(text):
            if kind != "console":
                (folder / title).write_text(content, encoding="utf-8")
                continue
            for command in read_block(content):
                if command.program == "cd":
                    target = command.text.split()[1].replace("~", environment["HOME"])
                    folder = folder / target
                elif command.left_running:
                    running.enter_context(_left_running(command, folder, environment))
                elif command.program not in INSTALLING:
                    assert_does_what_is_shown(command, folder, environment)


@contextmanager
def _left_running(command: Command, folder: Path, environment: Mapping[str, str]) -> Iterator[None]:
    """Start a program and wait until it has printed what is shown, or else its first line."""
    process = subprocess.Popen(
        shlex.split(command.text, comments=True),
        cwd=folder,
        env={**environment, "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    overdue = threading.Timer(BOUND_S, process.kill)
    overdue.start()
    try:
        printed = process.stdout.readline()
        while command.output and first_unprinted((*command.output, "..."), printed) is not None:
            line = process.stdout.readline()
            assert line, f"{command.text}\n{printed}\nnot as shown: {command.output}"
            printed += line
        assert printed, f"{command.text} printed nothing"
        overdue.cancel()
        reader = threading.Thread(target=process.stdout.read, daemon=True)
        reader.start()  # A full pipe would hold the program up.
        yield
    finally:
        overdue.cancel()
        process.send_signal(signal.SIGINT)
        try:
            process.wait(BOUND_S)
        finally:
            process.kill()
