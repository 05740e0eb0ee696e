"""Reads the files of cases; says file, line and case of whatever is wrong with one."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from m2pem.mission.values import Value
from tests.cases.case import ENDS, Case, Expected, Step
from tests.cases.when import read_when

DATA = Path(__file__).parents[1] / "data"
TOPICS = sorted(DATA.glob("[0-9]*/*.yaml"))

_REQUIRED = ("file", "case", "clause", "element", "variant", "steps", "then")
_OPTIONAL = ("given", "extension", "process")
_AFTER_A_STEP = ("at", "data", "prompts", "throws")
_AT_THE_END = (*_AFTER_A_STEP, "ended", "detail")


class CaseError(Exception):
    """A case that cannot be read: `place: case: what is wrong`."""


@cache
def read_cases() -> list[Case]:
    """Every case of every chapter's folder."""
    return [case for topic in TOPICS for case in read_topic(topic)]


@cache
def read_topic(path: Path) -> tuple[Case, ...]:
    """The cases of one file.

    Raises:
        CaseError: one of them cannot be read.
    """
    try:
        found = YAML().load(path.read_text(encoding="utf-8"))
    except YAMLError as error:
        raise CaseError(f"{path}: {error}") from None
    if not isinstance(found, CommentedSeq):
        raise CaseError(f"{path}: is no list of cases")
    cases = []
    for place, item in enumerate(found):
        line = found.lc.item(place)[0] + 1
        if not isinstance(item, CommentedMap):
            raise CaseError(f"{path}:{line}: a case is a mapping that begins `- file: ...`")
        try:
            cases.append(_case(path, line, item))
        except _WrongError as error:
            title = item.get("case", "a case without a title")
            raise CaseError(f"{path}:{error.line or line}: {title}: {error}") from None
    return tuple(cases)


class _WrongError(Exception):
    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


def _case(topic: Path, line: int, item: CommentedMap) -> Case:
    for key in _REQUIRED:
        if key not in item:
            raise _WrongError(f"`{key}:` is missing")
    for key in item:
        if key not in _REQUIRED + _OPTIONAL:
            known = ", ".join(_REQUIRED + _OPTIONAL)
            raise _WrongError(f"`{key}:` is none of {known}", item.lc.key(key)[0] + 1)
    file = topic.parent / str(item["file"])
    if not file.is_file():
        raise _WrongError(f"there is no {file.name} beside it", item.lc.key("file")[0] + 1)
    return Case(
        topic=topic,
        line=line,
        file=file,
        title=str(item["case"]),
        clause=str(item["clause"]),
        element=str(item["element"]),
        variant=str(item["variant"]),
        given=_mapping(item.get("given"), "given", item),
        steps=tuple(_step(step, item) for step in item["steps"]),
        then=_then(item),
        extension=str(item.get("extension") or ""),
        process=str(item.get("process") or ""),
    )


def _step(step: object, case: CommentedMap) -> Step:
    if not isinstance(step, CommentedMap):
        wrong = f"step {step!r} is not of the form `- start: a b c`"
        raise _WrongError(wrong, _line(case, "steps"))
    line = step.lc.line + 1
    whens = [key for key in step if key not in ("with", *_AFTER_A_STEP)]
    if len(whens) != 1:
        raise _WrongError(f"a step has one input, and this one {whens}", line)
    try:
        when = read_when(str(whens[0]), _mapping(step.get("with"), "with", step))
    except ValueError as error:
        raise _WrongError(str(error), line) from error
    return Step(when, _words(step[whens[0]], line), _expected(step, line))


def _then(case: CommentedMap) -> Expected:
    then, line = case["then"], _line(case, "then")
    if isinstance(then, str):
        then = {"ended": then}
    if not isinstance(then, Mapping):
        raise _WrongError("`then:` is a word or a mapping", line)
    for key in then:
        if key not in _AT_THE_END:
            raise _WrongError(f"then: `{key}:` is none of {', '.join(_AT_THE_END)}", line)
    if then.get("ended") not in ENDS:
        raise _WrongError(f"then: `ended:` is one of {', '.join(ENDS)}", line)
    return _expected(then, line)


def _expected(item: Mapping[Any, Any], line: int) -> Expected:
    throws = item.get("throws")
    if throws is not None and not isinstance(throws, list):
        throws = [throws]
    return Expected(
        at=_words(item["at"], line) if "at" in item else None,
        data=_mapping(item["data"], "data", None, line) if "data" in item else None,
        prompts=_words(item["prompts"], line) if "prompts" in item else None,
        throws=None if throws is None else tuple(str(each) for each in throws),
        ended=item.get("ended"),
        detail=None if item.get("detail") is None else str(item["detail"]),
    )


def _words(value: object, line: int) -> tuple[str, ...]:
    """Words of a string or a list; `nothing` is none."""
    if value is None or value == "nothing":
        return ()
    if isinstance(value, str):
        return tuple(value.split())
    if isinstance(value, list):
        return tuple(str(each) for each in value)
    raise _WrongError(f"{value!r} is neither ids with blanks between, nor a list of ids", line)


def _mapping(value: object, key: str, case: CommentedMap | None, line: int = 0) -> dict[str, Value]:
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise _WrongError(
            f"`{key}:` is a mapping of names to values", _line(case, key) if case else line
        )
    return {str(name): _plain(each) for name, each in value.items()}


def _plain(value: Any) -> Value:
    """Without the types in which the YAML reader keeps places and spelling."""
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            plain: Value = kind(value)
            return plain
    if value is None:
        return None
    raise _WrongError(f"{value!r} is no value of a mission; put times in quotes")


def _line(item: CommentedMap, key: str) -> int:
    return int(item.lc.key(key)[0]) + 1
