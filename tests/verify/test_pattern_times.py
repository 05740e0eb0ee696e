"""Times of patterns, `within` and `for`: what they mean in runs, in words, and what is refused."""

from collections.abc import Sequence

import pytest

from m2pem.fleet.default_fleet import fleet_for
from m2pem.monitors.timed import TimedEvaluation, TimedPlan
from m2pem.units import US_PER_S
from m2pem.verify.ltl import show
from m2pem.verify.ltl.formula import Active, Commanded, Completed, Ended
from m2pem.verify.requirements import Names, Requirement, RequirementsError, parse_spec
from tests.verify.missions import in_a_row, task

MISSION = in_a_row(task("Drive", "ugv1", "goto", target="gate"), task("Back", "ugv1", "hold"))
NAMES = Names(MISSION, fleet_for(MISSION))
LETTERS = {
    "d": Completed("Drive"),
    "a": Active("Drive"),
    "b": Active("Back"),
    "u": Commanded("ugv1"),
    "e": Ended("completed"),
    "E": Ended(),
}


def read(pattern: str, arguments: str) -> Requirement:
    text = f"requirements: [{{id: r, pattern: {pattern}, args: {{{arguments}}}}}]"
    (found,) = parse_spec(text.encode(), "spec.yaml", NAMES)
    return found


def verdict(requirement: Requirement, run: str, ends_s: float) -> tuple[str, float]:
    """What a monitor says of a run, and when. `run`: "0 a, 3 d": from 0 s on Drive is active, at
    3 s it is completed; a moment lasts until the next one. It is over at `ends_s`."""
    plan = TimedPlan(requirement.formula)
    evaluation = TimedEvaluation(plan)
    moments: list[tuple[float, Sequence[str]]] = [
        (float(at), [*letters.replace("-", "")])
        for at, letters in (each.split() for each in run.split(", "))
    ]
    for place, (at_s, letters) in enumerate(moments):
        held = {LETTERS[each] for each in letters}
        letter = sum(1 << n for n, each in enumerate(plan.base) if each in held)
        if evaluation.read(round(at_s * US_PER_S), letter).is_certain:
            return str(evaluation.verdict), at_s
        next_s = moments[place + 1][0] if place + 1 < len(moments) else ends_s
        while (due := evaluation.due_us) is not None and due <= next_s * US_PER_S:
            if evaluation.advance(due).is_certain:
                return str(evaluation.verdict), (due - 1) / US_PER_S
    return str(evaluation.end()), ends_s


WHEN = "when: Drive, then: active(Back)"


@pytest.mark.parametrize(
    ("pattern", "arguments", "satisfying", "violating", "violated_s"),
    [
        ("existence", "what: Drive, within: 30 s", "0 -, 30 d, 30 -", "0 -, 31 d, 31 -", 30),
        (
            "existence",
            "what: active(Back), for: 5 s",
            "0 -, 9 b, 14.1 -",
            "0 b, 4 -, 9 b, 13 -",
            50,
        ),
        (
            "existence",
            "what: active(Back), within: 10 s, for: 5 s",
            "0 -, 10 b, 15.1 -",
            "0 b, 4 -, 11 b",
            10,
        ),
        (
            "existence",
            "what: active(Back), after: Drive, within: 3 s",
            "9 d, 12 b",
            "9 d, 13 b",
            12,
        ),
        (
            "existence",
            "what: active(Back), before: Drive, within: 3 s",
            "0 -, 2 b, 4 d",
            "0 -, 4 b, 5 d",
            5,
        ),
        ("absence", "what: active(Back), for: 5 s", "0 b, 4.9 -, 6 b, 10 -", "0 -, 2 b", 7),
        ("global_avoidance", "avoid: active(Back), for: 5 s", "0 b, 4 -", "0 -, 2 b", 7),
        (
            "future_avoidance",
            "avoid: active(Back), when: Drive, for: 5 s",
            "0 b, 9 d, 9 b, 13 -",
            "0 -, 9 d, 9 b",
            14,
        ),
        ("universality", "what: active(Back), for: 5 s", "0 b, 6 -", "0 b, 4 -", 4),
        (
            "universality",
            "what: '!active(Back)', after: Drive, for: 5 s",
            "0 b, 1 d, 7 b",
            "1 d, 3 b",
            3,
        ),
        ("response", f"{WHEN}, within: 8 s", "1 d, 1 -, 9 b", "1 d, 1 -, 9.5 b", 9),
        ("response", f"{WHEN}, within: 8 s, for: 2 s", "1 d, 8 b, 11 -", "1 d, 8 b, 9 -", 9),
        ("delayed_reaction", f"{WHEN}, within: 8 s", "1 d, 1 -, 9 b", "1 d, 1 -, 9.5 b", 9),
        ("instantaneous_reaction", f"{WHEN}, for: 2 s", "1 db, 1 b, 3 b, 4 -", "1 db, 1 b, 2 -", 2),
        (
            "past_avoidance",
            "avoid: active(Back), until: Drive, within: 9 s",
            "0 -, 9 d, 9 b",
            "0 -, 9.1 d",
            9,
        ),
        ("wait", "hold: active(Back), until: Drive, within: 9 s", "0 b, 9 d", "0 b, 3 -, 4 d", 3),
        (
            "commanded_again",
            "resource: ugv1, when: Drive, within: 4 s",
            "1 d, 1 -, 5 u",
            "1 d, 1 -",
            5,
        ),
        (
            "commanded_again",
            "resource: ugv1, when: Drive, within: 4 s",
            "1 d, 1 -, 5 E",
            "1 d, 1 -",
            5,
        ),
        ("reaches_proper_end", "within: 1 min", "0 -, 60 eE", "0 -, 61 eE", 60),
    ],
)
def test_a_time_is_kept_or_violated_when_it_is_over(
    pattern: str, arguments: str, satisfying: str, violating: str, violated_s: float
) -> None:
    requirement = read(pattern, arguments)
    assert verdict(requirement, satisfying, 50)[0] == "satisfied"
    assert verdict(requirement, violating, 50) == ("violated", violated_s)


@pytest.mark.parametrize(
    ("pattern", "arguments", "formula", "english"),
    [
        (
            "existence",
            "what: Drive, within: 30 s",
            "<>[0 s, 30 s] completed(Drive)",
            "Within 30 s 'DRIVE' is completed.",
        ),
        (
            "absence",
            "what: active(Drive), for: 1.5 min",
            "[]![][0 s, 90 s] active(Drive)",
            "Never (for 90 s 'DRIVE' is active).",
        ),
        (
            "response",
            f"{WHEN}, within: 8 s, for: 2 s",
            "[](completed(Drive) -> <>[0 s, 8 s] [][0 s, 2 s] active(Back))",
            "Whenever 'DRIVE' is completed, within 8 s (for 2 s 'BACK' is active).",
        ),
        (
            "wait",
            "hold: active(Back), until: Drive, within: 9 s",
            "active(Back) U[0 s, 9 s] completed(Drive)",
            "'BACK' is active until 'DRIVE' is completed, which comes within 9 s.",
        ),
        (
            "reaches_proper_end",
            "within: 1 min",
            "<>[0 s, 60 s] (ended(completed) || ended(terminated))",
            "The mission comes to an end that the model means within 60 s.",
        ),
        (
            "commanded_again",
            "resource: ugv1, when: Drive, within: 500 ms",
            "[](completed(Drive) -> <>[0 s, 0.5 s] (commanded(ugv1) || ended))",
            "Whenever 'DRIVE' is completed, ugv1 is commanded within 0.5 s, or the mission ends.",
        ),
    ],
)
def test_the_formula_and_its_words_have_the_time(
    pattern: str, arguments: str, formula: str, english: str
) -> None:
    found = read(pattern, arguments)
    assert (show(found.formula), found.english) == (formula, english)


@pytest.mark.parametrize(
    ("pattern", "arguments", "where", "says"),
    [
        (
            "existence",
            "what: Drive, within: 30",
            "within",
            "'30' is no time with its unit; write 30 s",
        ),
        (
            "existence",
            "what: Drive, within: 30 m",
            "within",
            "'30 m' is a distance, not a duration",
        ),
        ("existence", "what: Drive, within: soon", "within", "'soon' is not a number with a unit"),
        ("existence", "what: Drive, within: 0 s", "within", "is no time up to 30 days"),
        ("existence", "what: Drive, within: 999 h", "within", "is no time up to 30 days"),
        ("existence", "what: Drive, within: [1 s]", "within", "is no time with its unit"),
        ("existence", "what: Drive, for: 5 s", "for", "completed(Drive) is true in one moment"),
        ("response", "when: Drive, then: Back, for: 5 s", "for", "write active(Back)"),
        (
            "existence",
            "what: '<> active(Drive)', within: 5 s",
            "",
            "in an operator with bounds each [], <> and U has bounds",
        ),
        (
            "absence",
            "what: 'once(completed(Drive))', for: 5 s",
            "",
            "once, historically, since and count look beyond bounds",
        ),
        (
            "absence",
            "what: active(Drive), before: Back, for: 5 s",
            "",
            "'for' may go beyond its end; only 'after' goes with it",
        ),
        ("precedence", "first: Drive, then: Back, within: 5 s", "within", "takes no 'within'"),
    ],
)
def test_a_time_that_means_nothing_is_refused(
    pattern: str, arguments: str, where: str, says: str
) -> None:
    with pytest.raises(RequirementsError) as caught:
        read(pattern, arguments)
    (finding,) = caught.value.findings
    assert finding.element == f"requirements[0].args{f'.{where}' if where else ''}"
    assert says in str(finding)


def test_a_part_that_ends_cuts_off_what_a_condition_asks_for() -> None:
    """A formula with bounds as a condition: its `[]` counts up to the end of the part."""
    required = read("existence", "what: '[][0 s, 5 s] active(Back)', before: Drive")
    assert verdict(required, "0 -, 2 b, 4 d", 20)[0] == "satisfied"
    assert verdict(required, "0 -, 4 d, 5 b", 20)[0] == "violated"
