"""Plays a case with m2pem's engine, and compares."""

from collections.abc import Iterator

from m2pem import load_mission
from m2pem.engine import records as r
from m2pem.mission.values import Value
from tests.cases.case import Case, Expected, Step
from tests.cases.when import When
from tests.engine.kit import CANCELLED, FAILED, SUCCEEDED, Play
from tests.engine.trace import line

_THROWN = (r.SignalThrown, r.MessageThrown, r.EscalationThrown, r.ErrorThrown)
_REPORTS = {"complete": SUCCEEDED, "fail": FAILED, "cancelled": CANCELLED}


def play_case(case: Case) -> Play:
    """The run of a case; inputs only, nothing is compared."""
    play = begin(case)
    for step in case.steps:
        give(play, step.when, case)
    return play


def begin(case: Case) -> Play:
    return Play(load_mission(case.file))


def give(play: Play, when: When, case: Case) -> None:
    """Hand in one input."""
    match when.verb:
        case "start":
            play.start(dict(case.given), process=case.process or None)
        case "answer":
            play.answer(when.word or "done", prompt=_prompt(play, when))
        case "signal":
            play.signal(when.name, when.data)
        case "message":
            play.message(when.name, when.data)
        case "advance":
            play.advance(when.seconds)
        case "pause" | "resume" | "stop":
            getattr(play, when.verb)()
        case _:
            _work(play, when)


def _prompt(play: Play, when: When) -> str:
    prompts = [p.id for p in play.run.state.prompts.values() if p.token.node.id == when.name]
    assert len(prompts) >= when.number, f"{when.text}: {when.name} asks {len(prompts)} times"
    return prompts[when.number - 1]


def _work(play: Play, when: When) -> None:
    """The end of a service, or of a behavior, at the element."""
    services = [s for s in play.run.state.services.values() if s.token.node.id == when.name]
    if not services:
        play.report(when.name, _REPORTS[when.verb], when.word)
    elif when.verb == "complete":
        play.complete(when.name, **when.data)
    else:
        play.fail(when.name, when.word)


# --- comparing ----------------------------------------------------------------------------------


def differences(case: Case) -> str:
    """Play it; "" when all is as expected, else a table of what was expected and what came."""
    play = begin(case)
    lines: list[str] = []
    same = True
    for step in case.steps:
        before = len(play.steps)
        lines.append(f"  {step.when.text}")
        try:
            give(play, step.when, case)
        except (AssertionError, KeyError) as error:
            return _report(case, [*lines, f"    not possible: {error}"])
        for what, expected, got in _compared(step, play, before):
            same &= expected == got
            lines += _lines(what, expected, got)
    lines.append("  then")
    for what, expected, got in _after(case.then, play, 0):
        same &= expected == got
        lines += _lines(what, expected, got)
    return "" if same else _report(case, lines)


def _report(case: Case, lines: list[str]) -> str:
    head = f"{case.place}: {case.title} ({case.file.name}; clause {case.clause})"
    return "\n".join([head, *lines])


def _lines(what: str, expected: object, got: object) -> list[str]:
    if expected == got:
        return [f"    {what}: {_text(got)}"]
    return [
        f"  ! {what}: expected {_text(expected)}",
        f"    {' ' * len(what)}  got      {_text(got)}",
    ]


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(value) if value else "nothing"
    return str(value)


def _compared(step: Step, play: Play, before: int) -> Iterator[tuple[str, object, object]]:
    yield "enters", step.entered, entered(play, before)
    yield from _after(step.expected, play, before)


def entered(play: Play, before: int = 0) -> tuple[str, ...]:
    """The elements that tokens entered, from that input on."""
    records = [record for step in play.steps[before:] for record in step.records]
    return tuple(x.element for x in records if isinstance(x, r.TokenEntered))


def _after(expected: Expected, play: Play, before: int) -> Iterator[tuple[str, object, object]]:
    if expected.at is not None:
        yield "at", tuple(sorted(expected.at)), tuple(sorted(play.at.split()))
    if expected.prompts is not None:
        asked = [prompt.token.node.id for prompt in play.run.state.prompts.values()]
        yield "prompts", tuple(sorted(expected.prompts)), tuple(sorted(asked))
    if expected.throws is not None:
        yield "throws", expected.throws, tuple(_thrown(play, before))
    if expected.data is not None:
        yield "data", expected.data, _seen(play, expected.data)
    if expected.ended is not None:
        yield "ended", expected.ended, play.ended or "running"
    if expected.detail is not None:
        found = expected.detail if expected.detail in play.detail else play.detail
        yield "detail", expected.detail, found


def _thrown(play: Play, before: int) -> Iterator[str]:
    for step in play.steps[before:]:
        for record in step.records:
            if isinstance(record, _THROWN):
                yield " ".join(line(record).split()[:2])


def _seen(play: Play, names: dict[str, Value]) -> dict[str, Value]:
    data = play.data
    return {name: data.get(name) for name in names}
