"""A case that fails shows each of its steps, with what was expected and what came."""

from dataclasses import replace

from tests.cases import DATA, Case, read_topic
from tests.cases.playing import differences

[CASE, *_] = read_topic(DATA / "10.6-gateways" / "exclusive.yaml")


def with_entered(case: Case, *entered: str) -> Case:
    first, *others = case.steps
    return replace(case, steps=(replace(first, entered=entered), *others))


def test_nothing_is_said_of_a_case_that_goes_as_it_should() -> None:
    assert differences(CASE) == ""


def test_a_case_that_goes_otherwise_is_shown_step_by_step() -> None:
    assert differences(with_entered(CASE, "start", "which", "b")).splitlines() == [
        f"10.6-gateways/exclusive.yaml:1: {CASE.title} "
        "(exclusive_first_true.bpmn; clause 10.6.2, table 13.2)",
        "  start",
        "  ! enters: expected start which b",
        "            got      start which a",
        "    at: a",
        "  answer a",
        "    enters: end",
        "  then",
        "    ended: completed",
    ]


def test_an_input_that_is_not_possible_is_said_to_be_so() -> None:
    first, second = CASE.steps
    wrong = replace(second, when=replace(second.when, name="b", text="answer b"))
    assert "not possible: answer b: b asks 0 times" in differences(
        replace(CASE, steps=(first, wrong))
    )
