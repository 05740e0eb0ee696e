"""The grammar of faults, which all simulators read."""

import re

import pytest

from m2pem.api.faults import (
    BATTERY,
    NUMBER,
    Effect,
    FaultError,
    FaultGrammar,
    FaultKind,
    FaultSchedule,
    battery_left,
    fixed,
)

Log = list[str]


def _battery(match: re.Match[str]) -> Effect[Log]:
    left = battery_left(match, low=0.1)
    return Effect(lambda log: log.append(f"{left:g}"))


GRAMMAR: FaultGrammar[Log] = FaultGrammar(
    {
        "silent": FaultKind(
            "silent", fixed(lambda log: log.append("silent"), lambda log: log.append("well"))
        ),
        "jump 20 m": FaultKind(
            rf"jump\s+{NUMBER}\s*m", lambda match: Effect(lambda log: log.append(match[1]))
        ),
        "battery low, battery 12 %": FaultKind(BATTERY, _battery),
        "reboot": FaultKind("reboot", fixed(lambda _: None, lambda _: None), for_s=5.0),
        "mode X at 40 s": FaultKind(r"mode\s+\S+", fixed(lambda _: None), timed=True),
    },
    "a: silent at 20 s for 5 s",
    targets=("[a-z]+", "vehicles: say their names, such as a or a,b"),
)


@pytest.mark.parametrize(
    ("text", "targets", "at_s", "for_s"),
    [
        ("silent", None, None, None),
        ("all: Silent at 2 min", None, 120.0, None),
        ("a, b: silent at 1.5s for 500 ms", ("a", "b"), 1.5, 0.5),
        ("  a:jump  7 m   at 3 s ", ("a",), 3.0, None),
        ("reboot", None, None, 5.0),
        ("reboot for 2 s", None, None, 2.0),
    ],
)
def test_targets_and_times_of_a_fault_are_read(
    text: str, targets: tuple[str, ...] | None, at_s: float | None, for_s: float | None
) -> None:
    fault = GRAMMAR.parse(text)
    assert (fault.targets, fault.at_s, fault.for_s) == (targets, at_s, for_s)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: slient", "'slient' is no action. Actions: silent; jump 20 m; battery low, battery"),
        ("silent at noon", "'silent at noon' is no action"),
        ("silent at 3 parsecs", "parsecs"),
        ("A1: silent", "'A1' are no vehicles: say their names, such as a or a,b, or all"),
        ("jump 3 m for 2 s", "'jump 3 m' has no end; leave 'for ... s' out"),
        ("battery 101 %", "a battery has at most 100 %"),
        ("mode X", "say when, such as 'mode X at 40 s'"),
    ],
)
def test_a_text_that_is_no_fault_is_refused_with_what_is_right(text: str, said: str) -> None:
    with pytest.raises(FaultError) as caught:
        GRAMMAR.parse(text)
    assert said in str(caught.value)
    assert repr(text) in str(caught.value)


def test_a_simulator_of_one_target_refuses_names() -> None:
    single = FaultGrammar({"silent": FaultKind("silent", fixed(lambda _: None))}, "silent at 1 s")
    assert single.parse("silent").targets is None
    with pytest.raises(FaultError, match="'a': leave it out, there is only one"):
        single.parse("a: silent")


def test_a_fault_strikes_the_vehicles_that_it_names() -> None:
    assert [*GRAMMAR.parse("silent").targets_among(["a", "b"])] == ["a", "b"]
    assert GRAMMAR.parse("b: silent").targets_among(["a", "b"]) == ("b",)
    with pytest.raises(FaultError, match="there is no vehicle c; there are: a, b"):
        GRAMMAR.parse("a,c: silent").targets_among(["a", "b"])


def test_a_fault_begins_and_ends_in_simulated_time() -> None:
    log: Log = []
    schedule = FaultSchedule()
    fault = GRAMMAR.parse("silent for 5 s")
    schedule.at(10.0, lambda: fault.start(log, lambda s, call: schedule.at(10.0 + s, call)))
    schedule.run_until(9.9)
    assert log == []
    schedule.run_until(14.9)
    assert log == ["silent"]
    schedule.run_until(15.0)
    assert log == ["silent", "well"]


def test_calls_for_the_same_time_come_in_the_order_of_planning() -> None:
    log: Log = []
    schedule = FaultSchedule()
    for time_s, name in ((2.0, "later"), (1.0, "first"), (1.0, "second")):
        schedule.at(time_s, lambda name=name: log.append(name))  # type: ignore[misc]
    schedule.run_until(2.0)
    assert log == ["first", "second", "later"]
