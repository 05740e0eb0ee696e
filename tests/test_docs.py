"""What the docs show works: their commands are run, their output is compared, their links lead on.

The commands of a block are run one after the other in one copy of the missions and fleets; what
else holds of them is said in `tests.console`.
"""

import re
import shlex
import shutil
import socket
from pathlib import Path

import pytest

from tests.console import (
    REPOSITORY,
    assert_does_what_is_shown,
    blocks,
    environment,
    first_unprinted,
    follow,
    make_workspace,
    read_block,
)

DOCS = REPOSITORY / "docs"
PAGES = [REPOSITORY / "README.md", *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("tutorials/*.md"))]
FROM_THE_CLONE = (DOCS / "start.md", DOCS / "troubleshooting.md")
FOLLOWED = (*FROM_THE_CLONE, *sorted(DOCS.glob("tutorials/*.md")))
"""Pages whose commands are run one after the other, as a reader does."""
NEEDS_ROS = DOCS / "tutorials" / "ros2.md"
"""The tests of the ROS plugin follow it."""
EXAMPLES = sorted((REPOSITORY / "examples").rglob("README.md"))
MAKE_TARGETS = {
    *(
        "setup",
        "demo",
        "demo-air",
        "demo-ros",
        "demo-team",
        "demo-gateway",
        "demo-web",
        "test",
        "test-long",
    ),
    *("test-ros", "ros", "fuzz", "lint", "format", "docs", "pictures", "conformance", "bench"),
    *("bench-quick", "chaos", "check", "clean", "demo-gateway", "demo-sitl", "dist"),
}

BLOCKS = {
    f"{page.relative_to(REPOSITORY)}:{line}": commands
    for page in PAGES
    for line, commands in blocks(page)
}
RUNNING_M2PEM = [
    name
    for name, block in BLOCKS.items()
    if any(c.program == "m2pem" for c in block)
    and not any(name.startswith(str(page.relative_to(REPOSITORY))) for page in FOLLOWED)
]


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    return make_workspace(tmp_path / "workspace")


@pytest.fixture
def unused_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_port:
        any_port.bind(("127.0.0.1", 0))
        return int(any_port.getsockname()[1])


@pytest.mark.parametrize("block", RUNNING_M2PEM)
def test_m2pem_commands_do_what_the_page_says(block: str, workspace: Path, tmp_path: Path) -> None:
    shell = environment(tmp_path / "home")
    for command in BLOCKS[block]:
        if command.program == "m2pem":
            assert_does_what_is_shown(command, workspace, shell)


@pytest.mark.parametrize(
    "page", [page for page in FOLLOWED if page != NEEDS_ROS], ids=lambda page: page.stem
)
def test_a_page_can_be_followed_from_its_first_command_to_its_last(
    page: Path, workspace: Path, tmp_path: Path, unused_udp_port: int
) -> None:
    shell = environment(tmp_path / "home")
    ports = {"14550": str(unused_udp_port)}
    if page not in FROM_THE_CLONE:
        patrol = shutil.copytree(DOCS / "tutorials" / "patrol", tmp_path / "home" / "patrol")
        fleet = patrol / "fleet_mavlink.yaml"
        fleet.write_text(fleet.read_text().replace("14550", ports["14550"]))
    follow(page, workspace, shell, ports)


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


@pytest.mark.parametrize(
    "page", [*PAGES, *EXAMPLES], ids=lambda page: str(page.relative_to(REPOSITORY))
)
def test_links_between_files_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)#\s]+)", text)
    files = [target for target in targets if "://" not in target]
    assert [target for target in files if not (page.parent / target).exists()] == []


def test_every_page_is_linked_from_the_index() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    pages = {str(page.relative_to(DOCS)) for page in PAGES[1:]} - {"index.md"}
    assert pages <= set(re.findall(r"\]\(([^)#]+\.md)", index))


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
