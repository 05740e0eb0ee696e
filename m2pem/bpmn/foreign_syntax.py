"""What other engines write, as m2pem reads it: for remedies. Nothing that is made here is run."""

import re
from collections.abc import Callable

from m2pem.bpmn.times import READERS
from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression import parse
from m2pem.mission.expression.literals import shorten, show_scalar
from m2pem.mission.script import parse_script

EXPRESSION = "write for example user.decision == 'continue' (docs/conditions.md)"
SCRIPT = "one statement a line: dotted.name = expression, or throw error CODE"

_MAX_CHARACTERS = 2_000
"""Of a script or expression that is looked at: what is longer is a program."""

_MAX_STATEMENTS = 5
_MAX_TIME_CHARACTERS = 50
_WORDS = re.compile(r"[\w .,:;!?@/+-]+")
_COMMENT = re.compile(r"//|#(?!\{)")
_PRINT = re.compile(r"(?:System\.out\.print(?:ln)?|console\.log|print(?:ln)?)\b.*")
_SET = re.compile(r"(?:execution|kcontext)\.setVariable\(\s*(['\"])([\w.]+)\1\s*,\s*(.*)\)")
_THROW = re.compile(r"throw new (?:[\w.]*\.)?BpmnError\(\s*(['\"])([\w.:-]+)\1.*\)")
_ASSIGN = re.compile(r"(?:(?:var|def|let|const|int|String|Object)\s+)?([^\W\d][\w.]*\s*=[^=].*)")
_QUOTED = re.compile(r"(['\"])(.*)\1")
_FEEL_TIME = re.compile(r"=\s*[a-z ]+\(\s*\"([^\"]*)\"\s*\)")
_SHORT = re.compile(r"([0-9]+) ?(ms|[smhd])", re.IGNORECASE)
_NAME = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
_REPEATED = "###"


def expression_remedy(text: str) -> str:
    """Return the remedy for an expression that cannot be read."""
    if len(text) <= _MAX_CHARACTERS:
        inner = text.strip().removeprefix("return ").removesuffix(";").strip()
        if _reads(parse, inner):
            return f"write {shorten(inner)}, without a language"
        feel = f"= {inner.replace('==', '=')}".replace("'", '"')
        if "=" in inner and _reads(parse, feel):
            return f"write {shorten(feel)}, as FEEL does"
    return EXPRESSION


def value_remedy(text: str) -> str:
    """Return the remedy for a text that is no expression: other engines read it as plain text."""
    if _WORDS.fullmatch(text.strip()):
        return f"a text is written in quotes: '{shorten(text.strip())}'"
    return expression_remedy(text)


def script_remedy(text: str, attribute: str = "scriptFormat") -> str:
    """Return the remedy for a script in another language, which `attribute` names."""
    statements = _statements(text) if len(text) <= _MAX_CHARACTERS else None
    if statements is None or len(statements) > _MAX_STATEMENTS:
        return (
            f'write statements ({attribute}="m2pem"), a behavior ({attribute}="application/xml"), '
            "or make it a service task, whose class a plugin provides"
        )
    if not statements:
        return "it only prints: delete it, or make it a plain task"
    written = ", ".join(f"'{shorten(statement)}'" for statement in statements)
    lines = "lines" if len(statements) > 1 else "line"
    return f'write the {lines} {written} ({attribute}="m2pem")'


def statement_remedy(line: str) -> str:
    """Return the remedy for a line of a script whose language is unknown."""
    statements = _statements(line) if len(line) <= _MAX_CHARACTERS else None
    if statements is None:
        return SCRIPT
    return f"write '{shorten(statements[0])}'" if statements else "it only prints: delete it"


def _statements(text: str) -> list[str] | None:
    """The statements that would do the same; None when there is one that has none."""
    found = []
    for line in text.splitlines():
        statement = line.strip().rstrip("; \t")
        if not statement or _COMMENT.match(statement) or _PRINT.fullmatch(statement):
            continue
        if match := _SET.fullmatch(statement):
            found.append(f"{match[2]} = {match[3]}")
        elif match := _THROW.fullmatch(statement):
            found.append(f"throw error {match[2]}")
        elif match := _ASSIGN.fullmatch(statement):
            found.append(match[1])
        else:
            return None
    return None if parse_script("\n".join(found))[1] else found


_FORMS = {
    "timeDate": "write it as ISO 8601, such as 2026-01-31T12:00:00Z",
    "timeDuration": "write it as ISO 8601, such as PT30S",
    "timeCycle": "write it as ISO 8601 (R3/PT10S), or as cron does (0 0 8 * * MON-FRI)",
}


def time_remedy(kind: str, text: str) -> str:
    """Return the remedy for a timer's text; `kind` is timeDuration, timeDate or timeCycle."""
    text = text.strip()
    if len(text) > _MAX_TIME_CHARACTERS:
        return _FORMS[kind]
    for pattern in (_QUOTED, _FEEL_TIME):
        match = pattern.fullmatch(text)
        if match and _reads(READERS[kind], match[match.re.groups]):
            return f"write {match[match.re.groups]} alone"
    if "(" in text and _reads(parse, f"= {text}"):
        return f"write = {shorten(text)}, as FEEL does"
    if _reads(READERS[kind], text.upper()):
        return f"write {text.upper()}, in capitals"
    for other, read in READERS.items():
        if other != kind and _reads(read, text):
            return f"put it into a {other}"
    *_, period = text.split(_REPEATED)
    if match := _SHORT.fullmatch(period):
        written = _iso(int(match[1]), match[2].lower())
        if kind == "timeDuration":
            return f"write {written}"
        if kind == "timeCycle":
            once = "" if _REPEATED in text else f", or R1/{written} for once"
            return f"write R/{written}{once}"
    if text.isdecimal():
        return f"write it with its unit: PT{shorten(text)}S are seconds"
    if _NAME.fullmatch(text):
        return f"{_FORMS[kind]}; a name of the data is written ${{{shorten(text)}}}"
    return _FORMS[kind]


def _iso(count: int, unit: str) -> str:
    if unit == "ms":
        return f"PT{show_scalar(count / 1000)}S"
    return f"P{count}D" if unit == "d" else f"PT{count}{unit.upper()}"


def _reads(read: Callable[[str], object], text: str) -> bool:
    try:
        read(text)
    except ExpressionSyntaxError:
        return False
    return True
