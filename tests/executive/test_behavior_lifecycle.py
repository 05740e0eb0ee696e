"""No two owners of a behavior's state disagree, whatever happens to it."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from m2pem.executive.behavior_lifecycle import (
    JOINT_STATES,
    TRANSITIONS,
    BehaviorViews,
)
from tests.seeds import examples

from .lifecycle_world import VEHICLES, follows, live

NAMES = [each.name for each in JOINT_STATES]

UP = [("climb", "uav1"), ("climb", "uav2"), ("sleep", 30.0)]
UNDER_WAY = [("begin", "ugv1"), ("sleep", 2.0)]

STORIES: dict[str, tuple[list[tuple[Any, ...]], list[list[str]]]] = {
    "it is interrupted, and another behavior takes its vehicle over": (
        [*UNDER_WAY, ("turn",), ("sleep", 60.0)],
        [["under way", "ended"], ["under way", "ended"]],
    ),
    "its link is lost and returns": (
        [*UNDER_WAY, ("cut", "ugv1"), ("sleep", 10.0), ("mend", "ugv1"), ("sleep", 20.0)],
        [["under way", "out of reach", "lost", "ended"]],
    ),
    "what takes its vehicle over is refused before it has stopped": (
        [*UNDER_WAY, ("fault", "ugv1", "reject", 0.0), ("turn",), ("sleep", 10.0)],
        [["under way", "cancelling", "ended"], ["ended"]],
    ),
    "it waits for a slow arbiter": (
        [*UNDER_WAY, ("slow", 2.0), ("turn",), ("sleep", 30.0)],
        [["under way", "cancelling", "ended"], ["requested", "starting", "under way", "ended"]],
    ),
    "it is stopped before its turn": (
        [*UNDER_WAY, ("slow", 2.0), ("turn",), ("sleep", 0.5), ("stop", 0), ("sleep", 30.0)],
        [["under way", "cancelling", "ended"], ["requested", "withdrawn", "ended"]],
    ),
    "an operator takes its vehicle before its turn, in a pause": (
        [
            *UNDER_WAY,
            ("slow", 2.0),
            ("stop", 0),
            ("begin", "ugv1"),
            ("sleep", 0.5),
            ("pause", 1),
            ("take", "ugv1"),
            ("sleep", 10.0),
            ("resume", 1),
            ("sleep", 10.0),
        ],
        [["under way", "cancelling", "ended"], ["requested", "refused", "ended"]],
    ),
    "its executive crashes, and it goes on": (
        [*UNDER_WAY, ("crash", 5.0), ("sleep", 1.0), ("old_command",), ("sleep", 1.0)],
        [["under way", "cancelling", "ended"]],
    ),
    "its arbiter knows it no more after a crash, and an operator has it started again": (
        [
            *UNDER_WAY,
            ("crash_and_forget", 5.0),
            ("sleep", 1.0),
            ("answer", "resume"),
            ("sleep", 5.0),
        ],
        [["under way", "unsettled", "under way", "cancelling", "ended"]],
    ),
    "the same in a paused run": (
        [
            *UNDER_WAY,
            ("pause", 0),
            ("crash_and_forget", 5.0),
            ("sleep", 1.0),
            ("resume", 0),
            ("sleep", 1.0),
            ("answer", "skip"),
            ("sleep", 30.0),
        ],
        [["under way", "end unknown", "unsettled", "cancelling", "ended"], ["under way", "ended"]],
    ),
    "it does not end within the limit of its cancel": (
        [*UNDER_WAY, ("deafen",), ("stop", 0), ("sleep", 600.0)],
        [["under way", "cancelling", "given up", "ended"]],
    ),
    "an aircraft is out of reach after its end": (
        [*UP, ("cut", "uav1"), ("sleep", 10.0), ("mend", "uav1"), ("sleep", 5.0)],
        [["under way", "ended", "out of reach", "lost", "ended"], ["under way", "ended"]],
    ),
}


@pytest.mark.parametrize("story", STORIES)
def test_a_behavior_goes_through_the_stages_of_its_story(story: str, tmp_path: Path) -> None:
    steps, expected = STORIES[story]
    lives = live(steps, tmp_path)
    assert lives.wrong == []
    assert list(lives.stages.values()) == expected


def test_the_stories_reach_every_stage() -> None:
    reached = {stage for _, lives in STORIES.values() for life in lives for stage in life}
    assert set(NAMES) - reached == set()


names = st.sampled_from(VEHICLES)
places = st.integers(0, 4)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("sleep"), st.sampled_from([0.0, 0.1, 1.0, 5.0, 30.0])),
        st.tuples(st.just("begin"), names),
        st.tuples(st.just("climb"), names.filter(lambda name: name.startswith("uav"))),
        st.tuples(st.just("turn")),
        st.tuples(st.sampled_from(["pause", "resume", "stop"]), places),
        st.tuples(st.sampled_from(["take", "give_back", "cut", "mend"]), names),
        st.tuples(st.just("answer"), st.sampled_from(["resume", "skip", "abort"])),
        st.tuples(
            st.just("fault"),
            names,
            st.sampled_from(["reject", "fail", "stall", "lose_link"]),
            st.sampled_from([0.0, 2.0]),
        ),
        st.tuples(st.just("slow"), st.sampled_from([0.0, 0.2, 2.0])),
        st.tuples(
            st.sampled_from(["crash", "crash_and_forget"]), st.sampled_from([0.0, 1.0, 60.0])
        ),
        st.tuples(st.just("old_command")),
        st.tuples(st.just("deafen")),
    ),
    max_size=25,
)


@settings(
    max_examples=examples(15, 60), deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(st.booleans(), steps)
def test_no_two_owners_disagree_whatever_happens(
    flying: bool, steps: list[tuple[Any, ...]]
) -> None:
    with TemporaryDirectory() as folder:
        lives = live([*(UP if flying else ()), *steps], Path(folder))
    assert lives.wrong == []


def test_no_two_stages_allow_the_same_views() -> None:
    for one in JOINT_STATES:
        for other in JOINT_STATES:
            shared = [
                set(getattr(one, owner)) & set(getattr(other, owner))
                for owner in BehaviorViews.__dataclass_fields__
            ]
            assert one is other or not all(shared), (one.name, other.name)


def test_transitions_lead_from_each_stage_to_the_end() -> None:
    assert {each.source for each in TRANSITIONS} | {each.target for each in TRANSITIONS} == set(
        NAMES
    )
    assert [name for name in NAMES if not follows(name, "ended")] == []
