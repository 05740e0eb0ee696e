"""The four field-test vignettes of the paper (section 6), rehearsed to each of their ends."""

import logging
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from m2pem import load_fleet
from m2pem.api.arbiter import ArbiterContext
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.runs import RunStatus
from m2pem.bpmn import parse_mission
from m2pem.engine import records as r
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.loading import findings_for
from m2pem.findings import Finding
from m2pem.fleet.fleet import Fleet
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import EndEvent
from m2pem.mission.mission import Mission
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import check_answers, load_answers
from m2pem.rehearsal.rehearsal import RehearsalResult, rehearse
from m2pem.telemetry.bus import Bus

REPOSITORY = Path(__file__).parents[2]
MISSIONS = REPOSITORY / "missions"
ANSWERS = MISSIONS / "answers"
FLEET = REPOSITORY / "fleet_configs" / "mehds.yaml"

FULL_NAMES = {"sweep": "road_sweep", "follow": "road_following_formation", "stop": "drive_stop"}
"""Of what is commanded most, by the words of the stories."""


class Story(NamedTuple):
    """One way through a vignette: its answers file, how the run ends, at which end events (with
    those of the UAV's process), and what vehicles and payloads are commanded, in order."""

    answers: str
    status: RunStatus
    ends: tuple[str, ...]
    commanded: dict[str, str]

    @property
    def mission(self) -> Path:
        return MISSIONS / f"{self.answers[: len('mehds_vignette_N')]}.bpmn"


COMPLETED, TERMINATED = RunStatus.COMPLETED, RunStatus.TERMINATED

STORIES = [
    Story(
        "mehds_vignette_1_swept",
        COMPLETED,
        ("EndSwept",),
        {
            "evsg1": "sweep stop follow bridge_crossing sweep",
            "evsg2": "sweep stop teleop stop follow bridge_crossing sweep",
            "evsg3": "sweep stop follow bridge_crossing sweep",
        },
    ),
    Story(
        "mehds_vignette_1_unswept",
        COMPLETED,
        ("EndUnswept",),
        {
            "evsg1": "sweep stop sweep bridge_crossing bridge_crossing sweep sweep",
            "evsg2": "sweep stop teleop stop sweep bridge_crossing bridge_crossing sweep sweep",
        },
    ),
    Story(
        "mehds_vignette_1_aborted",
        TERMINATED,
        ("EndAborted",),
        {"evsg3": "sweep sweep follow stop"},
    ),
    Story(
        "mehds_vignette_1_aborted_at_start",
        TERMINATED,
        ("EndAborted",),
        {"evsg1": "stop", "evsg2": "stop", "evsg3": "stop"},
    ),
    Story(
        "mehds_vignette_1_aborted_at_bridge",
        TERMINATED,
        ("EndAborted",),
        {"evsg1": "sweep stop follow stop", "evsg2": "sweep stop teleop stop follow stop"},
    ),
    Story(
        "mehds_vignette_2_rejoined",
        COMPLETED,
        ("EndRejoined",),
        {
            "evsg1": "follow single_vehicle_routing formation",
            "evsg2": "follow follow formation",
            "evsg3": "follow follow formation",
            "evsg2/ptz": "ptz_scan_sector",
        },
    ),
    Story(
        "mehds_vignette_2_recalled",
        COMPLETED,
        ("EndRejoined",),
        {"evsg1": "follow single_vehicle_routing formation", "evsg3": "follow follow formation"},
    ),
    Story("mehds_vignette_2_not_moved_out", COMPLETED, ("EndNotStarted",), {}),
    Story(
        "mehds_vignette_2_aborted", TERMINATED, ("EndAborted",), {"evsg1": "follow formation stop"}
    ),
    Story(
        "mehds_vignette_2_aborted_unheard",
        TERMINATED,
        ("EndAborted",),
        {"evsg1": "follow single_vehicle_routing stop", "evsg2": "follow follow stop"},
    ),
    Story(
        "mehds_vignette_3_cleared",
        COMPLETED,
        ("EndCleared",),
        {
            "evsg1": "follow formation formation sweep formation sweep",
            "evsg2": "follow goto formation formation sweep formation sweep",
            "evsg2/ptz": "ptz_scan_polygon",
        },
    ),
    Story(
        "mehds_vignette_3_crossed",
        COMPLETED,
        ("EndCrossed",),
        {
            "evsg1": "follow bridge_crossing",
            "evsg2": "follow goto goto bridge_crossing",
            "evsg2/ptz": "ptz_scan_polygon ptz_scan_polygon",
        },
    ),
    Story("mehds_vignette_3_not_approached", COMPLETED, ("EndNotStarted",), {"evsg1": "follow"}),
    Story(
        "mehds_vignette_3_aborted",
        TERMINATED,
        ("EndAborted",),
        {"evsg2": "follow goto bridge_crossing", "evsg2/ptz": "ptz_scan_polygon"},
    ),
    Story(
        "mehds_vignette_4_hazard",
        COMPLETED,
        ("EndHazard", "EndLanded"),
        {
            "evsg3": "follow stop formation follow stop",
            "evsg2/ptz": "ptz_track",
            "uav1": "takeoff area_observe return_to_launch",
        },
    ),
    Story(
        "mehds_vignette_4_advanced",
        COMPLETED,
        ("EndAdvanced", "EndFailsafe"),
        {
            "evsg3": "follow stop formation formation follow formation follow",
            "uav1": "takeoff area_observe return_to_launch",
        },
    ),
    Story(
        "mehds_vignette_4_route_driven",
        COMPLETED,
        ("EndLanded", "EndRouteDriven"),
        {"evsg1": "follow", "uav1": "takeoff takeoff area_observe return_to_launch"},
    ),
    Story(
        "mehds_vignette_4_aborted",
        COMPLETED,
        ("EndAborted", "EndLanded"),
        {"evsg1": "follow stop stop", "uav1": "takeoff area_observe return_to_launch"},
    ),
    Story(
        "mehds_vignette_4_following_aborted",
        COMPLETED,
        ("EndFollowingAborted", "EndLanded"),
        {"evsg1": "follow follow stop", "uav1": "takeoff area_observe return_to_launch"},
    ),
    Story(
        "mehds_vignette_4_aborted_unheard",
        COMPLETED,
        ("EndAborted", "EndLanded"),
        {"evsg1": "follow stop stop", "uav1": "takeoff area_observe return_to_launch"},
    ),
    Story(
        "mehds_vignette_4_following_aborted_unheard",
        COMPLETED,
        ("EndFollowingAborted", "EndLanded"),
        {"evsg1": "follow follow stop", "uav1": "takeoff area_observe return_to_launch"},
    ),
    Story("mehds_vignette_4_not_started", COMPLETED, ("EndNotStarted",), {}),
]

NEVER_TAKEN = {"FlowTeleopEnded"}
"""A rehearsal answers the prompt beside the teleoperation at once, before that could end."""

every_story = pytest.mark.parametrize("story", STORIES, ids=lambda story: story.answers)
ALSO_SHORT = {
    "mehds_vignette_1_aborted",
    "mehds_vignette_2_aborted_unheard",
    "mehds_vignette_3_crossed",
    "mehds_vignette_4_following_aborted_unheard",
}
"""One of each vignette, with both statuses: the others go the same way, and take long when run."""

every_story_when_long = pytest.mark.parametrize(
    "story",
    [
        pytest.param(
            story,
            marks=() if story.answers in ALSO_SHORT else pytest.mark.long,
            id=story.answers,
        )
        for story in STORIES
    ],
)
every_vignette = pytest.mark.parametrize("number", range(1, 5))


@cache
def plugins() -> PluginManager:
    return PluginManager(block=("all",))


@cache
def fleet() -> Fleet:
    return load_fleet(FLEET)


@cache
def mission(path: Path) -> Mission:
    return parse_mission(path.read_bytes(), path.name)


@cache
def rehearsed(path: Path, answers: Path | None) -> RehearsalResult:
    return rehearse(path, fleet(), plugins=plugins(), answers=answers)


def result(story: Story) -> RehearsalResult:
    return rehearsed(story.mission, ANSWERS / f"{story.answers}.yaml")


def of_vignette(number: int) -> list[Story]:
    return [story for story in STORIES if story.answers.startswith(f"mehds_vignette_{number}_")]


def commanded(result: RehearsalResult, resource: str) -> list[str]:
    return [
        stamped.record.name
        for stamped in result.records
        if isinstance(stamped.record, r.BehaviorRequested) and resource in stamped.record.resources
    ]


def outer_ends(story: Story, result: RehearsalResult) -> list[str]:
    """End events reached, but those inside subprocesses and called processes."""
    entered = {
        stamped.record.element
        for stamped in result.records
        if isinstance(stamped.record, r.TokenEntered)
    }
    here = mission(story.mission)
    called = {"DETECTION", "ADVANCE"}
    return sorted(
        node.id
        for process in here.processes
        if process.id not in called
        for node in process.nodes
        if isinstance(node, EndEvent) and node.id in entered
    )


# --- the missions -------------------------------------------------------------------------------


@every_vignette
def test_nothing_is_to_be_found_wrong_with_the_mission_and_its_fleet(number: int) -> None:
    async def findings(clock: VirtualClock) -> list[Finding]:
        context = ArbiterContext(clock, Bus(), logging.getLogger("test"), fleet().origin)
        arbiters = FleetArbiters(fleet(), plugins(), context)
        path = MISSIONS / f"mehds_vignette_{number}.bpmn"
        return findings_for(mission(path), arbiters, plugins())

    assert run_virtual(findings, 0) == []


def test_every_answers_file_of_the_vignettes_is_tried() -> None:
    files = {path.stem for path in ANSWERS.glob("mehds_vignette_*.yaml")}
    assert files == {story.answers for story in STORIES}


def test_the_page_on_the_field_tests_names_every_answers_file() -> None:
    page = (REPOSITORY / "docs" / "field-tests.md").read_text(encoding="utf-8")
    assert [story.answers for story in STORIES if f"`{story.answers}.yaml`" not in page] == []


@every_story
def test_the_answers_fit_the_mission(story: Story) -> None:
    answers = load_answers(ANSWERS / f"{story.answers}.yaml")
    assert list(check_answers(answers, mission(story.mission))) == []


@every_vignette
def test_the_stories_go_through_every_element_and_flow(number: int) -> None:
    path = MISSIONS / f"mehds_vignette_{number}.bpmn"
    records = [s.record for story in of_vignette(number) for s in result(story).records]
    entered = {record.element for record in records if isinstance(record, r.TokenEntered)}
    taken = {record.flow for record in records if isinstance(record, r.FlowTaken)}
    nodes = mission(path).nodes
    assert {node.id for node in nodes} - entered == set()
    assert {flow.id for node in nodes for flow in node.outgoing} - taken - NEVER_TAKEN == set()


# --- what happens in them -----------------------------------------------------------------------


@every_story
def test_the_story_comes_to_its_end(story: Story) -> None:
    told = result(story)
    detail = "terminated by mission aborted" if story.status is TERMINATED else ""
    assert (told.summary.status, told.summary.detail) == (story.status, detail)
    assert outer_ends(story, told) == sorted(story.ends)


@every_story
def test_vehicles_and_payloads_do_what_the_story_says(story: Story) -> None:
    told = result(story)
    for resource, expected in story.commanded.items():
        assert commanded(told, resource) == [
            FULL_NAMES.get(word, word) for word in expected.split()
        ]
    if not story.commanded:
        assert not any(isinstance(s.record, r.BehaviorRequested) for s in told.records)


@every_story
def test_everything_that_was_commanded_is_released_once(story: Story) -> None:
    records = [stamped.record for stamped in result(story).records]
    requested = [record.behavior for record in records if isinstance(record, r.BehaviorRequested)]
    ended = [record.behavior for record in records if isinstance(record, r.BehaviorEnded)]
    assert Counter(ended) == Counter(requested)


@every_story
def test_no_vehicle_is_commanded_by_two_behaviors_at_once(story: Story) -> None:
    holders: dict[str, set[str]] = {}
    for record in (stamped.record for stamped in result(story).records):
        if isinstance(record, r.BehaviorRequested):
            for resource in record.resources:
                held_by = holders.setdefault(resource, set())
                assert held_by <= set(record.preempts), f"{record.element} takes {resource}"
                held_by.add(record.behavior)
        elif isinstance(record, r.BehaviorEnded):
            for held_by in holders.values():
                held_by.discard(record.behavior)
        assert not (isinstance(record, r.ErrorThrown) and record.code == "RESOURCE_UNAVAILABLE")


@every_story
def test_a_vehicle_that_was_interrupted_is_commanded_again(story: Story) -> None:
    newest: dict[str, str] = {}
    ended: dict[str, BehaviorState] = {}
    for record in (stamped.record for stamped in result(story).records):
        if isinstance(record, r.BehaviorRequested):
            newest |= {name: record.behavior for name in record.resources if "/" not in name}
        elif isinstance(record, r.BehaviorEnded):
            ended[record.behavior] = record.state
    left = {name: ended[behavior] for name, behavior in newest.items()}
    assert BehaviorState.CANCELLED not in left.values(), left


@every_vignette
def test_without_answers_the_planted_targets_are_found_and_the_vignette_is_told(
    number: int,
) -> None:
    told = rehearsed(MISSIONS / f"mehds_vignette_{number}.bpmn", None)
    whole = {1: "1_swept", 2: "2_rejoined", 3: "3_cleared", 4: "4_hazard"}[number]
    (story,) = [each for each in STORIES if each.answers == f"mehds_vignette_{whole}"]
    assert told.summary.status is COMPLETED
    assert outer_ends(story, told) == sorted(story.ends)


@pytest.mark.parametrize(
    ("answers", "element", "lead"),
    [
        ("mehds_vignette_3_cleared", "Approach", "evsg2"),
        ("mehds_vignette_3_cleared", "ClearRoute", "evsg1"),
        ("mehds_vignette_4_hazard", "RoadFollowing", "evsg2"),
        ("mehds_vignette_4_hazard", "Advance", "evsg3"),
    ],
)
def test_the_vehicle_that_the_route_calls_for_takes_the_lead(
    answers: str, element: str, lead: str
) -> None:
    (story,) = [each for each in STORIES if each.answers == answers]
    leads = {
        stamped.record.resources[0]
        for stamped in result(story).records
        if isinstance(stamped.record, r.BehaviorRequested) and stamped.record.element == element
    }
    assert leads == {lead}


def test_the_route_that_the_operator_chooses_is_cleared() -> None:
    (story,) = [each for each in STORIES if each.answers == "mehds_vignette_3_cleared"]
    routes = [
        stamped.record.parameters["route"]
        for stamped in result(story).records
        if isinstance(stamped.record, r.BehaviorRequested)
        and stamped.record.element == "ClearRoute"
    ]
    assert routes == ["route_delta", "route_echo"]
