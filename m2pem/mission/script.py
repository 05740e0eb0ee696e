"""Scripts of script tasks: one statement a line, `dotted.name = expression` or `throw error CODE`.

Expressions are in the bare dialect of `m2pem.mission.expression`. Blank lines, and what follows a
`#`, are skipped.
"""

import re

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.behavior import Assignment, Script, ThrowError
from m2pem.mission.expression import Dialect, parse
from m2pem.mission.expression.dialect import outside_quotes
from m2pem.mission.expression.lexer import scan_name
from m2pem.mission.expression.literals import shorten
from m2pem.mission.expression.vocabulary import is_reserved

_THROW = re.compile(r"throw\s+error\s+(\S+)")
_CODE = re.compile(r"[\w.:-]+")
_FORM = "write 'name = expression' or 'throw error CODE'"


class _StatementError(Exception):
    """What is wrong with a line."""


def parse_script(text: str, line: int = 1) -> tuple[Script, list[tuple[int, str]]]:
    """The statements that are well, and every line that is not, with what is wrong with it.

    `line` is the number of the script's first line in its file. An empty list means that the
    whole script is well.
    """
    statements: list[Assignment | ThrowError] = []
    problems: list[tuple[int, str]] = []
    for number, content in enumerate(text.replace("\r\n", "\n").split("\n"), line):
        statement = content[: outside_quotes(content, "#")].strip()
        if not statement:
            continue
        try:
            statements.append(_statement(statement, number))
        except (_StatementError, ExpressionSyntaxError) as error:
            problems.append((number, str(error)))
    return Script(tuple(statements)), problems


def _statement(text: str, line: int) -> Assignment | ThrowError:
    if text.startswith("throw") and (throw := _THROW.fullmatch(text)):
        if not _CODE.fullmatch(throw[1]):
            raise _StatementError(
                f"{shorten(throw[1])!r} is no error code: letters, digits, '_', '-', '.' and ':'"
            )
        return ThrowError(throw[1], line)
    end = scan_name(text, 0, len(text))
    key, rest = text[:end], text[end:].lstrip()
    if not key or not rest.startswith("=") or rest.startswith("=="):
        raise _StatementError(f"{shorten(text)!r} is no statement; {_FORM}")
    if is_reserved(key, Dialect.BARE):
        raise _StatementError(f"{key!r} is a word of the language and cannot be a name")
    return Assignment(key, parse(rest[1:].strip(), Dialect.BARE), line)
