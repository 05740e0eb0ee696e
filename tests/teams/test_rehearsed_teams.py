"""A rehearsal goes through what a team of real vehicles would, and says the same each time."""

import math
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from m2pem.api.runs import RunStatus
from m2pem.errors import MissionError
from m2pem.fleet.fleet import LostMemberPolicy
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.plugins import PluginManager
from m2pem.rehearsal.rehearsal import RehearsalResult, rehearse
from m2pem.simulation.faults import Fault
from m2pem.teams.paths import MemberPath, slot
from tests.seeds import examples

from .conftest import START_US, area, one_task, route
from .rehearsed import Rehearsed, rehearsed, sim_fleet

COLUMN = {"a": (0.0, 0.0), "b": (-20.0, 0.0), "c": (-40.0, 0.0)}
ROAD = {
    "road": route((50, 0), (250, 0), (250, 200)),
    "field": area((0, 0), (200, 0), (200, 90), (0, 90)),
}
MARCH = one_task("road_following_formation", route="road", spacing="20 m", speed="5 m/s")
GO_ON, STOP = LostMemberPolicy.CONTINUE, LostMemberPolicy.STOP
QUICK = settings(
    max_examples=examples(8, 30),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    phases=(Phase.explicit, Phase.generate),  # shrinking would take minutes
)


def rehearsal(mission_: bytes, **kw: Any) -> RehearsalResult:
    return rehearse(
        mission_,
        sim_fleet(COLUMN, ROAD, **kw),
        plugins=PluginManager(block=("all",)),
    )


def test_the_same_rehearsal_has_the_same_records_to_the_microsecond() -> None:
    slow = {"b": {"max_speed": "2 m/s"}}
    one, two = (rehearsal(MARCH, settings=slow) for _ in range(2))
    assert one.summary.status is RunStatus.COMPLETED
    assert one.records == two.records


def test_a_member_who_is_slow_is_waited_for_and_nobody_comes_too_near() -> None:
    async def story(world: Rehearsed) -> Any:
        await world.executive.control.start(MARCH)
        gaps: list[tuple[float, float]] = []

        def look() -> None:
            a, b, c = (world.place(name) for name in "abc")
            if a[0] < 240:  # on the first leg, along which the gaps are seen
                gaps.append((a[0] - b[0], b[0] - c[0]))

        await world.until_ended(look)
        return gaps, world.ended()[0].state, [world.place(name) for name in "abc"]

    fleet = sim_fleet(COLUMN, ROAD, settings={"b": {"max_speed": "2 m/s"}})
    gaps, state, ends = rehearsed(fleet, story)
    assert state is BehaviorState.SUCCEEDED
    assert max(gap for gap, _ in gaps) < 20 + 2 * 10 + 10, "the lead waits"
    assert min(map(min, gaps)) >= 10
    for found, wanted in zip(ends, [(250, 200), (250, 180), (250, 160)], strict=True):
        assert math.dist(found, wanted) < 1.0


def test_a_run_with_telemetry_goes_as_its_rehearsal() -> None:
    """The march is steered by where the vehicles are, however often they tell it."""
    quiet = rehearsal(MARCH)
    told: list[float] = []

    async def story(world: Rehearsed) -> None:
        run = await world.executive.control.start(MARCH)
        await world.executive.control.wait(run)
        told.append((world.clock.now_us() - START_US) / 1e6)

    rehearsed(sim_fleet(COLUMN, ROAD), story, settings={"telemetry_hz": 5})
    assert quiet.records[-1].t_s == pytest.approx(told[0], abs=1e-3)


def test_an_answers_file_strikes_the_members_of_a_team(tmp_path: Path) -> None:
    answers = tmp_path / "answers.yaml"
    answers.write_text("behaviors: {Task: [{after: 20 s, end: failed, error: ROUTE_BLOCKED}]}\n")
    result = rehearse(
        MARCH, sim_fleet(COLUMN, ROAD), plugins=PluginManager(block=("all",)), answers=answers
    )
    (ended,) = [s for s in result.records if type(s.record).__name__ == "BehaviorEnded"]
    assert (ended.record.state, ended.record.code) == (BehaviorState.FAILED, "ROUTE_BLOCKED")
    assert 20 <= ended.t_s < 30


def test_a_duration_of_a_team_is_waited_for() -> None:
    result = rehearsal(one_task("area_observe", area="field", duration="10 min"))
    assert result.summary.status is RunStatus.COMPLETED
    assert 600 < result.records[-1].t_s < 800


@pytest.mark.parametrize("name", ["area_observe", "escort"])
def test_a_team_that_stays_for_ever_is_seen_to_wait_for_nothing(name: str) -> None:
    wished = {"area": "field"} if name == "area_observe" else {"target": "[38.1075, -77.318]"}
    result = rehearsal(one_task(name, **wished))
    assert result.summary.status is RunStatus.FAILED
    assert result.records[-1].t_s < 600


def test_a_team_of_which_one_was_never_received_is_refused_and_the_rehearsal_waits_for_it() -> None:
    result = rehearsal(
        one_task("area_survey", area="field"), settings={"a": {"link_lost": [{"at": "0 s"}]}}
    )
    assert "the position of a is not known" in result.summary.detail
    assert result.records[-1].t_s == pytest.approx(1.5, abs=0.2)


def test_a_march_that_nobody_can_end_is_given_up_and_named() -> None:
    stalled = {"a": {"faults": [{"kind": "stall", "after": "20 s"}]}}
    result = rehearsal(MARCH, settings=stalled)
    assert result.summary.status is RunStatus.FAILED
    assert "Task" in str(result.records)
    assert 120 < result.records[-1].t_s < 300


FAULTS = {"fail": "ROUTE_BLOCKED", "lose_link": "LINK_LOST"}


@QUICK
@given(
    st.sampled_from(["a", "b", "c"]),
    st.floats(0.0, 150.0),
    st.sampled_from(sorted(FAULTS)),
    st.sampled_from([STOP, GO_ON]),
    st.sampled_from(
        ["road_following_formation", "road_sweep", "formation", "bridge_crossing", "area_survey"]
    ),
)
def test_a_member_lost_at_any_time_leaves_the_team_as_its_policy_says(
    victim: str, after_s: float, kind: str, policy: LostMemberPolicy, behavior: str
) -> None:
    wished = {"area": "field"} if behavior == "area_survey" else {"route": "road"}
    code = FAULTS[kind]

    async def story(world: Rehearsed) -> Any:
        error = code if kind == "fail" else ""
        fault = Fault(kind, after_s=after_s, error=error)
        world.sim.inject(ResourceId(victim), fault)
        await world.executive.control.start(one_task(behavior, **wished))
        await world.until_ended()
        (ended,) = world.ended()
        others = [name for name in "abc" if name != victim]
        speeds = [world.speed_m_s(name) for name in others]
        await world.clock.sleep(60)
        assert [world.speed_m_s(name) for name in others] == [0, 0], "nobody goes on afterwards"
        return ended, speeds, world.seen

    ended, speeds, seen = rehearsed(sim_fleet(COLUMN, ROAD, policy=policy), story)
    if not ended.reason:  # it was over before
        assert ended.state is BehaviorState.SUCCEEDED, ended
        return
    assert code in f"{ended.code} {ended.reason}", ended
    assert speeds == [0, 0], "they stand when it is said to have ended"
    if policy is STOP or (behavior == "bridge_crossing" and ended.state is BehaviorState.FAILED):
        assert (ended.state, ended.code) == (BehaviorState.FAILED, code), seen[-5:]
        assert ended.reason.startswith(f"{victim}: ")
    else:
        assert ended.state is BehaviorState.SUCCEEDED, ended
        assert ended.reason.startswith(f"without {victim} ({code}")


@QUICK
@given(
    st.lists(
        st.tuples(st.floats(30, 150), st.floats(-1.2, 1.2)),
        min_size=1,
        max_size=4,
    ),
    st.sampled_from(["column", "diamond"]),
    st.floats(10.0, 40.0),
    st.lists(st.floats(1.0, 15.0), min_size=5, max_size=5),
)
def test_the_spacing_is_kept_on_any_route_whatever_the_members_can(
    legs: list[tuple[float, float]], shape: str, spacing_m: float, fastest_m_s: list[float]
) -> None:
    places, yaw = [(20.0, 0.0)], 0.0
    for length, turn in legs:
        east, north = places[-1]
        places.append((east + length * math.cos(yaw), north + length * math.sin(yaw)))
        yaw += turn
    names = "vwxyz"
    slots = {name: slot(shape, rank) for rank, name in enumerate(names)}
    starts = {name: (-spacing_m * back, spacing_m * left) for name, (back, left) in slots.items()}
    # Those of the middle lane; what they have driven is told from where they are.
    lane = [name for name in names if slots[name][1] == 0]
    corners = [(-spacing_m * len(names), 0.0), *places]
    steps = [math.dist(*each) for each in pairwise(corners)]
    marks = [sum(steps[:index]) for index in range(len(corners))]
    way = MemberPath([(*corner, 0.0) for corner in corners], marks)
    fleet = sim_fleet(
        starts,
        {"way": route(*places)},
        settings={
            name: {"max_speed": f"{fastest:.3f} m/s"}
            for name, fastest in zip(names, fastest_m_s, strict=True)
        },
    )

    async def story(world: Rehearsed) -> Any:
        await world.executive.control.start(
            one_task("road_following_formation", route="way", shape=shape, spacing=f"{spacing_m} m")
        )
        gone = {name: way.find(world.place(name), None, 0.0) for name in lane}
        gaps: list[float] = []

        def look() -> None:
            for name in lane:
                gone[name] = way.find(world.place(name), gone[name], 50.0)
            gaps.extend(gone[one] - gone[two] for one, two in combinations(lane, 2))

        await world.until_ended(look)
        return gaps, world.ended()[0]

    gaps, ended = rehearsed(fleet, story)
    assert ended.state is BehaviorState.SUCCEEDED, ended
    assert min(gaps) >= spacing_m / 2 - 0.5


def test_a_formation_takes_the_offsets_of_its_author() -> None:
    async def story(world: Rehearsed) -> Any:
        await world.executive.control.start(
            one_task("formation", route="long", offsets="[[12, 8.5], [30, -4]]")
        )
        await world.until_ended()
        return world.ended()[0], [world.place(name) for name in "abc"]

    ended, ends = rehearsed(sim_fleet(COLUMN, {"long": route((50, 0), (250, 0))}), story)
    assert ended.state is BehaviorState.SUCCEEDED, ended
    for found, wanted in zip(ends, [(250, 0), (238, 8.5), (220, -4)], strict=True):
        assert math.dist(found, wanted) < 0.5


@pytest.mark.parametrize(
    ("wished", "why"),
    [
        ({"offsets": "[[10, 5]]"}, "there are 1 for 2 members after the lead"),
        ({"offsets": "[[10, 0], [10, 5]]", "shape": "line"}, "it says what 'shape' says, too"),
    ],
)
def test_offsets_that_make_no_formation_are_refused(wished: dict[str, str], why: str) -> None:
    result = rehearsal(one_task("formation", route="road", **wished))
    assert result.summary.status is RunStatus.FAILED
    assert why in str(result.records)


@pytest.mark.parametrize("offsets", ["behind", "[]", "[[1]]", "[[0, 0], [5, 5]]", "[[1, true]]"])
def test_offsets_that_cannot_be_read_are_found_before_the_mission_starts(offsets: str) -> None:
    with pytest.raises(MissionError, match="parameter 'offsets'"):
        rehearsal(one_task("formation", route="road", offsets=offsets))
