"""docs/writing-a-plugin.md is enough: what it says is typed, in a clean environment, and works.

Blocks with a title are files. In a `bash` block, a line that starts with `$ ` is a command and what
follows it is its output, as in tests/test_docs.py; a command with `# elsewhere` is another test's.
"""

import re
from pathlib import Path

import pytest

from m2pem.testing import ArbiterContract, JournalContract, OcuContract, ServiceContract
from tests.authoring.author import Author, free_port
from tests.console import Command, first_unprinted, read_block

PAGE = Path(__file__).parents[2] / "docs" / "writing-a-plugin.md"
TEXT = PAGE.read_text(encoding="utf-8")
FILES = dict(re.findall(r'^```\w+ title="(.+?)"\n(.*?)^```$', TEXT, re.M | re.S))
COMMANDS = [
    command
    for block in re.findall(r"^```bash\n(.*?)^```$", TEXT, re.M | re.S)
    for command in read_block(block)
]
PORTS = ("7001", "7002", "7070")


def test_the_arbiter_has_fewer_than_80_lines() -> None:
    assert len(FILES["m2pem_plugin_rover/arbiter.py"].splitlines()) < 80


def test_the_page_installs_runs_and_tests_what_it_builds() -> None:
    typed = " ".join(command.text for command in COMMANDS)
    for wanted in ("pip install m2pem", "pip install --editable .", "m2pem run", "-m pytest"):
        assert wanted in typed


@pytest.mark.long
@pytest.mark.timeout(600)
def test_an_author_with_the_page_and_pip_builds_runs_and_tests_the_plugin(author: Author) -> None:
    """The page's commands, in its order, print what it says. Ports are others, to be free."""
    ports = {said: str(free_port()) for said in PORTS}
    for name, code in FILES.items():
        file = author.folder / name
        file.parent.mkdir(exist_ok=True, parents=True)
        file.write_text(with_ports(code, ports))
    for command in COMMANDS:
        if not command.text.endswith("# elsewhere"):
            obey(author, command, ports)


def obey(author: Author, command: Command, ports: dict[str, str]) -> None:
    done = author.do(with_ports(command.text, ports))
    print(f"$ {command.text}\n{done.stdout}")
    assert done.returncode == command.status, f"{command.text}\n{done.stdout}"
    if command.output:
        missing = first_unprinted(command.output, done.stdout)
        assert missing is None, f"{command.text}\n{done.stdout}\nnot as shown: {missing}"


def with_ports(text: str, ports: dict[str, str]) -> str:
    for said, other in ports.items():
        text = text.replace(said, other)
    return text


def test_the_page_lists_what_each_contract_may_find_unsupported() -> None:
    contracts = (ArbiterContract, OcuContract, ServiceContract, JournalContract)
    listed = [
        f"| {contract.__name__} | `{subject}` | {meaning} |"
        for contract in contracts
        for subject, meaning in contract.subjects.items()
    ]
    assert re.findall(r"^\| \w+Contract \| .*$", TEXT, re.M) == listed
