"""Compares a rehearsal with what a scenario expects."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from m2pem.api.runs import StampedRecord
from m2pem.coverage.scenario_file import Expected
from m2pem.engine import records as r
from m2pem.mission.values import Value
from m2pem.rehearsal.rehearsal import RehearsalResult

_SHARED, _ROOT = 0, 1
"""Scopes with the data that the end of a run is compared by: data stores, and those of the process
that the run begins with (`StartRun` is decided first, so that its scope is 1)."""


def differences(expected: Expected, result: RehearsalResult) -> tuple[str, ...]:
    """Return a sentence for each thing that is not as expected."""
    return tuple(_differences(expected, result))


def _differences(expected: Expected, result: RehearsalResult) -> Iterator[str]:
    summary, records = result.summary, [each.record for each in result.records]
    ended = summary.status.value
    if expected.ended is not None and ended != expected.ended:
        detail = f" ({summary.detail})" if summary.detail else ""
        yield f"ended: expected {expected.ended}, got {ended}{detail}"
    if expected.detail is not None and expected.detail not in summary.detail:
        yield f"detail: expected '{expected.detail}' in '{summary.detail}'"
    took_s = summary.took_s or 0.0
    if expected.within is not None and took_s > expected.within:
        yield f"within: expected at most {expected.within:g} s, took {took_s:g} s"
    entered = [each.element for each in records if isinstance(each, r.TokenEntered)]
    if missing := first_missing(expected.entered or (), entered):
        yield f"entered: {missing}; tokens entered {_listed(entered)}"
    for element in expected.not_entered or ():
        if element in entered:
            at_s = _time_of(result.records, element)
            yield f"not_entered: a token entered {element} at {at_s:g} s"
    if expected.throws is not None:
        thrown = thrown_in(records)
        if missing := first_missing(expected.throws, thrown):
            yield f"throws: {missing}; thrown was {_listed(thrown)}"
    yield from _of_data(expected.data or {}, records)
    yield from _of_requirements(expected.requirements or {}, records)
    for resource, behaviors in (expected.commanded or {}).items():
        commanded = commanded_in(records, resource)
        if commanded != behaviors:
            got = _listed(commanded)
            yield f"commanded: {resource}: expected {_listed(behaviors)}, got {got}"


def first_missing(expected: Sequence[str], got: Iterable[str]) -> str:
    """Return what of a sequence does not come, in its order among others; "" if all does."""
    rest = iter(got)
    before = ""
    for each in expected:
        if not any(each == other for other in rest):
            return f"expected {each}" + (f" after {before}" if before else "")
        before = each
    return ""


def thrown_in(records: Iterable[r.Record]) -> list[str]:
    """Return what was thrown, in order, also from outside: "signal ID", "error CODE"."""
    thrown = []
    for record in records:
        match record:
            case r.SignalThrown(signal=signal):
                thrown.append(f"signal {signal}")
            case r.MessageThrown(message=message):
                thrown.append(f"message {message}")
            case r.EscalationThrown(code=code):
                thrown.append(f"escalation {code}")
            case r.ErrorThrown(code=code):
                thrown.append(f"error {code}")
            case _:
                pass
    return thrown


def commanded_in(records: Iterable[r.Record], resource: str) -> list[str]:
    """Return the behaviors that a vehicle or payload was commanded, in order."""
    return [
        each.name
        for each in records
        if isinstance(each, r.BehaviorRequested) and resource in each.resources
    ]


def data_at_end(records: Iterable[r.Record]) -> dict[str, Value]:
    """Return the data of the process that the run began with, and of data stores."""
    data: dict[str, Value] = {}
    for record in records:
        match record:
            case r.DataWritten(store=store, own=0) if store in (_SHARED, _ROOT):
                data[record.key] = record.value
            case _:
                pass
    return data


def _of_data(expected: Mapping[str, Any], records: Sequence[r.Record]) -> Iterator[str]:
    data = data_at_end(records)
    for name, value in expected.items():
        if name not in data and value is not None:
            yield f"data: {name}: expected {value!r}, nothing has written it"
        elif data.get(name) != value:
            yield f"data: {name}: expected {value!r}, got {data[name]!r}"


def _of_requirements(expected: Mapping[str, str], records: Sequence[r.Record]) -> Iterator[str]:
    verdicts = {
        each.requirement: "open" for each in records if isinstance(each, r.RequirementMonitored)
    }
    for record in records:
        if isinstance(record, r.RequirementDecided):
            verdicts[record.requirement] = record.verdict.value
    for name, verdict in expected.items():
        if name not in verdicts:
            known = ", ".join(verdicts) or "none"
            yield f"requirements: the run is not monitored for '{name}'; it is for: {known}"
        elif verdicts[name] != verdict:
            yield f"requirements: {name}: expected {verdict}, got {verdicts[name]}"


def _time_of(records: Iterable[StampedRecord], element: str) -> float:
    return next(
        each.t_s
        for each in records
        if isinstance(each.record, r.TokenEntered) and each.record.element == element
    )


def _listed(words: Sequence[str]) -> str:
    return ", ".join(words) if words else "nothing"
