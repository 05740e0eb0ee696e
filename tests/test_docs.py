"""What the docs show works: their commands are run, their output is compared, their links lead on.

In a `console` block, a line that starts with `$ ` is a command and what follows it is its output,
in which `...` stands for anything (alone on a line: for any lines). A block without `$ ` has only
commands. The commands of a block are run one after the other in one copy of the missions and
fleets. A comment says what is special: `# exit 1`, or `# interactive` for a command that needs a
person or never ends; of that one only the options are checked.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md"))]
WHAT_COMMANDS_READ = ("missions", "fleet_configs", "examples")
MAKE_TARGETS = {"setup", "demo", "test", "test-long", "lint", "format", "pictures", "clean"}


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


BLOCKS = {
    f"{page.relative_to(REPOSITORY)}:{line}": commands
    for page in PAGES
    for line, commands in blocks(page)
}
RUNNING_M2PEM = [name for name, block in BLOCKS.items() if any(c.program == "m2pem" for c in block)]


@pytest.fixture
def shell_environment(tmp_path: Path) -> dict[str, str]:
    """An empty home, and the m2pem of the environment that runs the tests first on the path."""
    home = tmp_path / "home"
    home.mkdir()
    here = {name: value for name, value in os.environ.items() if not name.startswith("XDG_")}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return {**here, "HOME": str(home), "PATH": path, "PYTHONPATH": str(REPOSITORY)}


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A copy of what the docs' commands read, in which they may write."""
    folder = tmp_path / "workspace"
    folder.mkdir()
    for name in WHAT_COMMANDS_READ:
        if (REPOSITORY / name).is_dir():
            shutil.copytree(REPOSITORY / name, folder / name)
    return folder


def run(text: str, folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", text],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize("block", RUNNING_M2PEM)
def test_m2pem_commands_do_what_the_page_says(
    block: str, workspace: Path, shell_environment: dict[str, str]
) -> None:
    for command in BLOCKS[block]:
        if command.program != "m2pem":
            continue
        if command.interactive:
            words = shlex.split(command.text, comments=True)
            usage = run(shlex.join([*words[:2], "--help"]), workspace, shell_environment)
            assert usage.returncode == 0, usage.stdout
            options = [word.split("=")[0] for word in words if word.startswith("--")]
            assert [option for option in options if option not in usage.stdout] == []
            continue
        done = run(command.text, workspace, shell_environment)
        assert done.returncode == command.status, f"{command.text}\n{done.stdout}"
        if command.output:
            missing = first_unprinted(command.output, done.stdout)
            assert missing is None, f"{command.text}\n{done.stdout}\nnot as shown: {missing}"


@pytest.mark.parametrize("block", BLOCKS)
def test_make_commands_name_targets(block: str) -> None:
    named = [shlex.split(c.text, comments=True)[1:] for c in BLOCKS[block] if c.program == "make"]
    targets = {word for words in named for word in words if "=" not in word}
    assert targets <= MAKE_TARGETS


def test_the_makefile_has_every_target() -> None:
    makefile = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
    assert set(re.findall(r"^([a-z-]+):.* ## ", makefile, re.M)) - {"help"} == MAKE_TARGETS


def test_the_readme_shows_m2pem_and_make() -> None:
    commands = [c for _, block in blocks(REPOSITORY / "README.md") for c in block]
    assert {"m2pem", "make"} <= {command.program for command in commands}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_between_files_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    files = [target for target in targets if "://" not in target]
    assert [target for target in files if not (page.parent / target).exists()] == []


def test_every_page_is_linked_from_the_index() -> None:
    index = (REPOSITORY / "docs" / "index.md").read_text(encoding="utf-8")
    pages = {page.name for page in PAGES} - {"README.md", "index.md"}
    assert pages <= set(re.findall(r"\]\(([^)#/]+\.md)", index))


def test_a_block_is_read_as_commands_with_their_output() -> None:
    block = "$ m2pem check \\\n    a.bpmn  # exit 1\na.bpmn: wrong\n$ m2pem runs\n"
    check, runs = read_block(block)
    assert (check.text, check.status) == ("m2pem check a.bpmn # exit 1", 1)
    assert check.output == ("a.bpmn: wrong",)
    assert (runs.text, runs.status, runs.output) == ("m2pem runs", 0, ())


@pytest.mark.parametrize(
    ("expected", "missing"),
    [
        (("one", "two", "three"), None),
        (("one", "...", "th...e"), None),
        (("...", "two", "..."), None),
        (("one", "three"), "three"),
        (("...", "two", "one"), "one"),
        (("one", "two"), "(the end of the output)"),
        (("one", "two", "three", "four"), "four"),
    ],
)
def test_output_that_differs_is_found(expected: tuple[str, ...], missing: str | None) -> None:
    assert first_unprinted(expected, "one\ntwo\nthree\n") == missing
