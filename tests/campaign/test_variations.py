import pytest

from m2pem.campaign.runs import order_of
from m2pem.campaign.variations import read_variations
from m2pem.errors import AnswersError
from m2pem.executive.loading import load_source
from m2pem.fleet.default_fleet import fleet_for
from m2pem.rehearsal.answers import load_answers
from tests.campaign.conftest import TWO, sequence


def test_a_drawn_run_is_an_answers_file_and_is_drawn_the_same_again() -> None:
    drawn = read_variations(TWO.encode()).draw(7, 3)
    assert drawn == read_variations(TWO.encode()).draw(7, 3)
    assert drawn != read_variations(TWO.encode()).draw(7, 4)
    assert set(drawn.answers) == {"behaviors", "vehicles"}
    assert 0.5 <= drawn.answers["vehicles"]["uav1"]["battery"] <= 1


def test_each_kind_of_thing_is_drawn() -> None:
    text = b"""
visits: 3
answers: {Ask: {yes: 1, no: 1}}
services:
  Look: {after: 1..2 s, write: [{weight: 1, data: {a: 1}}, {weight: 3, data: {a: 2}}]}
signals: [{id: stop, at: {exponential: 60 s}, probability: 0.5}]
messages: [{id: go, at: 5 s, data: {x: 1}}]
links: [{vehicle: uav1, at: 0..10 s, for: 5 s}]
wind: {speed: 0..8 m/s}
"""
    drawn = [read_variations(text).draw(1, run) for run in range(200)]
    assert {each.answers["answers"]["Ask"][0] for each in drawn} == {"yes", "no"}
    assert {len(each.answers["services"]["Look"]) for each in drawn} == {3}
    assert 60 < sum("signals" in each.answers for each in drawn) < 140
    assert all(
        each.answers["messages"] == [{"at": 5, "id": "go", "data": {"x": 1}}] for each in drawn
    )
    assert all(0 <= each.answers["vehicles"]["uav1"]["link_lost"][0]["at"] <= 10 for each in drawn)
    speeds = [each.answers["wind"]["speed"] for each in drawn]
    assert min(speeds) < 1
    assert max(speeds) > 7
    load_answers(b"wind: {speed: 3.25, from: 2.5 rad}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("behaviours: {}", "did you mean 'behaviors'"),
        ("behaviors:\n  A: {fails: {probability: 2}}", "variations.yaml:2"),
        ("behaviors:\n  A: {fails: {after: 2 s}}", "'probability' is missing"),
        ("behaviors:\n  A: {duration: 5..2 s}", "5 is above 2"),
        ("vehicles:\n  uav1: {batery: 5 %}", "did you mean 'battery'"),
        ("vehicles:\n  uav1: {battery: 5 kg..8}", "variations.yaml:2"),
        ("links: [{vehicle: uav1}]", "'at' is missing"),
        ("answer_times:\n  Ask: 5 s", "variations.yaml:2.*what is decided at Ask"),
        ("answers: {Ask: {yes: 1}}\nanswer_times:\n  Ask: -5 s", "variations.yaml:3"),
        ("visits: 0", "variations.yaml:1"),
    ],
)
def test_what_is_wrong_in_a_variations_file_is_said_with_its_line(text: str, message: str) -> None:
    with pytest.raises(AnswersError, match=message):
        read_variations(text.encode())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("behaviors:\n  C: {duration: 5 s}", "variations.yaml:2.*no task with a behavior 'C'"),
        ("answers: {A: {yes: 1}}", "no user task|no decision"),
        ("signals: [{id: stop, at: 5 s, probability: 0}]", "no signal with id 'stop'"),
        ("vehicles: {uav9: {battery: 5 %}}", "no vehicle or payload 'uav9'"),
    ],
)
def test_what_the_mission_or_the_fleet_lacks_is_refused(text: str, message: str) -> None:
    mission = load_source(sequence("A", "B"))
    with pytest.raises(AnswersError, match=message):
        order_of(mission, fleet_for(mission), text.encode(), 1)


def test_elements_keep_their_numbers_whatever_else_is_drawn() -> None:
    for run in range(20):
        alone = read_variations(b"behaviors: {B: {duration: 5..15 s}}").draw(7, run)
        both = read_variations(TWO.encode()).draw(7, run)
        for one, other in zip(
            alone.answers["behaviors"]["B"], both.answers["behaviors"]["B"], strict=True
        ):
            assert one == other or other["end"] == "failed"
