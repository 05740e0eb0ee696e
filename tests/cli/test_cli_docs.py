"""docs/cli.md has every command and option."""

import re

import click
import pytest

from m2pem.cli.group import COMMANDS, built_in
from m2pem.cli.plain import HELP
from tests.command_line import REPOSITORY

PAGE = (REPOSITORY / "docs" / "cli.md").read_text(encoding="utf-8")


def test_every_command_says_in_the_table_what_its_help_says() -> None:
    table = dict(re.findall(r"^\| \[`([\w-]+)`\]\(#[\w-]+\) \| (.+) \|$", PAGE, re.M))
    assert table.keys() == COMMANDS.keys()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_on_the_page(name: str) -> None:
    options = [each for each in built_in(name).params if isinstance(each, click.Option)]
    words = [word for each in options for word in each.opts]
    assert [word for word in words if not re.search(rf"`(m2pem {name} )?{word}[ `]", PAGE)] == []


def test_every_line_of_the_plain_operator_is_on_the_page() -> None:
    section = PAGE[PAGE.index("## The plain operator") : PAGE.index("## serve")]
    for line in HELP.splitlines()[:-1]:
        for word in re.split(r", (?:or )?", line[2:].partition("  ")[0]):
            if word.split()[0] not in ("2", "abort", "p3"):
                assert f"`{word}`" in section
