"""The field-test vignettes on the mixed fleet, over real DDS and UDP, to each of their ends.

What an answers file has a simulated arbiter do (`behaviors`), here happens to the vehicles: wheels
that are stuck, silence, an empty battery, a camera that does not turn.
"""

from pathlib import Path

import pytest
from ros_mehds_world import MISSIONS, SILENT, STUCK, MissionLog, Play, Story, Trouble, world

WITHIN_S = 420.0
RECALL = "cd8a5ef4-152f-55c0-a1e6-173bf4bb093b"

STORIES = [
    Story(
        "mehds_vignette_1_aborted",
        "terminated",
        ("EndAborted",),
        (
            Trouble("RouteSweep", 30, ground=f"evsg1: {SILENT}"),
            # By then all have gone back to where the route begins, and waited for each other there.
            Trouble("RouteSweep", 220, visit=2, ground=f"evsg3: {STUCK}"),
            Trouble("TraverseAlternate", 90, ground=f"evsg2: {STUCK}"),
        ),
    ),
    Story("mehds_vignette_1_aborted_at_start", "terminated", ("EndAborted",)),
    Story(
        "mehds_vignette_1_aborted_at_bridge",
        "terminated",
        ("EndAborted",),
        (Trouble("UserConfirmHazard", 0, ground="evsg2: kill for 22 s"),),
    ),
    Story("mehds_vignette_1_swept", "completed", ("EndSwept",)),
    Story(
        "mehds_vignette_1_unswept",
        "completed",
        ("EndUnswept",),
        (
            Trouble("BridgeCrossing", 5, ground=f"evsg2: {SILENT}"),
            Trouble("FinalSweep", 5, ground=f"evsg3: {STUCK}"),
            Trouble("FinalSweep", 15, visit=2, ground="evsg3: battery low"),
        ),
    ),
    Story(
        "mehds_vignette_2_aborted",
        "terminated",
        ("EndAborted",),
        (
            Trouble("MoveOut", 10, ground=f"evsg2: {STUCK}"),
            Trouble("JoinFormation", 20, ground=f"evsg2: {STUCK}"),
        ),
    ),
    Story(
        "mehds_vignette_2_aborted_unheard",
        "terminated",
        ("EndAborted",),
        (Trouble("NorthernRoute", 10, ground="evsg1: silent"),),
        given_up=("evsg1",),
    ),
    Story("mehds_vignette_2_not_moved_out", "completed", ("EndNotStarted",)),
    Story(
        "mehds_vignette_2_recalled",
        "completed",
        ("EndRejoined",),
        (Trouble("NorthernRoute", 15, signal=RECALL),),
    ),
    Story("mehds_vignette_2_rejoined", "completed", ("EndRejoined",)),
    Story(
        "mehds_vignette_3_aborted",
        "terminated",
        ("EndAborted",),
        (
            Trouble("PtzScan", 0.5, camera="stuck"),
            Trouble("BridgeCrossing", 5, ground=f"evsg2: {SILENT}"),
        ),
    ),
    Story(
        "mehds_vignette_3_cleared",
        "completed",
        ("EndCleared",),
        (
            Trouble("RollerLeads", 1, ground=f"evsg2,evsg3: {STUCK}"),
            Trouble("ClearRoute", 30, ground=f"evsg1: {STUCK}"),
        ),
    ),
    Story("mehds_vignette_3_crossed", "completed", ("EndCrossed",)),
    Story(
        "mehds_vignette_3_not_approached",
        "completed",
        ("EndNotStarted",),
        (Trouble("Approach", 40, ground="evsg1: battery low"),),
    ),
    Story("mehds_vignette_4_aborted", "completed", ("EndAborted", "EndLanded")),
    Story(
        "mehds_vignette_4_advanced",
        "completed",
        ("EndAdvanced", "EndFailsafe"),
        (
            Trouble("RoadFollowing", 30, ground="evsg3: silent for 28 s"),
            Trouble("GprLeads", 1, ground=f"evsg1,evsg2: {STUCK}"),
            Trouble("Advance", 20, ground=f"evsg3: {STUCK}"),
            Trouble("ReturnToLaunch", 2, air="1: cut link"),
        ),
    ),
    Story(
        "mehds_vignette_4_following_aborted",
        "completed",
        ("EndFollowingAborted", "EndLanded"),
        (
            Trouble("RoadFollowing", 10, ground=f"evsg2: {STUCK}"),
            Trouble("RoadFollowing", 10, visit=2, ground=f"evsg2: {STUCK}"),
        ),
    ),
    Story("mehds_vignette_4_hazard", "completed", ("EndHazard", "EndLanded")),
    Story("mehds_vignette_4_not_started", "completed", ("EndNotStarted",)),
    Story(
        "mehds_vignette_4_route_driven",
        "completed",
        ("EndLanded", "EndRouteDriven"),
        (
            Trouble("UserFollowRoute", 0, air="1: refuse arming for 70 s"),
            Trouble("AreaObserve", 40, air="1: battery low"),
        ),
    ),
]
DETECTED = Story(
    "mehds_vignette_4_hazard",
    "completed",
    ("EndHazard", "EndLanded"),
    (
        Trouble("AreaObserve", 10, found="person"),
        Trouble("AreaObserve", 20, found="triggerman"),
    ),
    live=("TriggermanDetector", "GprDetector"),
)
"""The man is found by the UAV's computer, and the mine by the radar that passes over it."""

SIMULATED_ALONE = {"mehds_vignette_4_aborted_unheard", "mehds_vignette_4_following_aborted_unheard"}
"""Vehicles that stand already have done as they are told, before it can be noticed that one of them
is silent; the ends are those of other stories (tests/e2e/test_field_missions.py)."""


def ends_of(story: Story) -> set[str]:
    """All end events to which stories of the same vignette come."""
    return {end for each in STORIES if each.mission == story.mission for end in each.ends}


def check(story: Story, told: MissionLog) -> None:
    assert told.status == story.status, (told.detail, told.errors)
    assert told.entered & ends_of(story) == set(story.ends), told.errors
    assert set(told.ended) == set(told.requested)


def test_every_answers_file_of_the_vignettes_is_tried() -> None:
    files = {path.stem for path in (MISSIONS / "answers").glob("mehds_vignette_*.yaml")}
    assert files - SIMULATED_ALONE == {story.answers for story in STORIES}


@pytest.mark.long
@pytest.mark.timeout(WITHIN_S + 60)
@pytest.mark.parametrize("story", [pytest.param(each, id=each.answers) for each in STORIES])
async def test_the_vignette_comes_to_its_end_on_the_mixed_fleet(
    story: Story, tmp_path: Path, ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain))
    with world(tmp_path, ros_domain) as simulated:
        told = await Play(simulated, story).run(WITHIN_S)
    print(story.answers, told.errors)
    check(story, told)


@pytest.mark.long
@pytest.mark.timeout(WITHIN_S + 60)
async def test_what_detectors_find_over_ros_decides_the_vignette(
    tmp_path: Path, ros_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros_domain))
    with world(tmp_path, ros_domain) as simulated:
        told = await Play(simulated, DETECTED).run(WITHIN_S)
    check(DETECTED, told)
    written = told.written
    assert [value for key, value in written if key == "detection.type"] == [
        "person",
        "triggerman",
        "gpr",
    ]
    assert [value for key, value in written if key == "detection.source"] == [
        "uav1/camera",
        "uav1/camera",
        "evsg3/gpr",
    ]
