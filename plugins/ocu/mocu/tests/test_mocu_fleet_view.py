"""What operators hear of payloads and teams by topics."""

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from m2pem_interfaces import msg
from m2pem_plugin_mocu.fleet_view import Outlines, team_status
from m2pem_plugin_ros.interfaces.vehicle_status import write_payload_status
from mocu_world import Client, Message, World
from rclpy.validate_topic_name import validate_topic_name

from m2pem.api import LinkState, PayloadState, ResourceId, TeamMemberState, TeamState
from m2pem.testing import scenarios

CAMERA = ResourceId("ugv2/camera")
CONNECTED = 1


def the_camera(message: Message) -> Message:
    found: list[Message] = [e for e in message["payloads"] if e["payload"] == CAMERA]
    return found[0] if found else {"pan_rad": math.nan, "behavior": "", "footprint": []}


SAID_EVERY_S = 0.05


@asynccontextmanager
async def said(world: World, state: Any) -> AsyncIterator[None]:
    """It is said again and again while the block lasts: of what changes quickly, such as a camera
    that is heard again, only the latest is told, which somebody slow may miss."""

    async def say() -> None:
        while True:
            world.bus.publish(state)
            await asyncio.sleep(SAID_EVERY_S)

    saying = asyncio.create_task(say())
    try:
        yield
    finally:
        saying.cancel()
        await asyncio.gather(saying, return_exceptions=True)


async def test_operators_hear_where_a_camera_looks_and_what_it_sees(
    world: World, client: Client
) -> None:
    mission = scenarios.one_behavior("ptz_point_at", CAMERA, bearing="90 deg", elevation="-45 deg")
    run = await world.control.start(mission, by="test")
    heard = await client.hears(
        "payloads", lambda each: abs(the_camera(each)["pan_rad"] - math.pi / 2) < 1e-3
    )
    await world.control.wait(run)
    camera = the_camera(heard)
    assert camera["tilt_rad"] == pytest.approx(-math.pi / 4, abs=1e-3)
    assert (camera["zoom"], camera["link"]) == (1.0, CONNECTED)
    assert len(camera["footprint"]) == 4

    def is_to_the_right(each: Message) -> bool:
        points = each["polygon"]["points"]
        return len(points) == 4 and all(0.5 < point["x"] < 5.0 for point in points)

    seen = await client.hears("footprints/ugv2/camera", is_to_the_right)
    assert seen["header"]["frame_id"] == "map"
    said = await client.hears(
        "diagnostics",
        lambda each: any(status["name"] == f"m2pem: link {CAMERA}" for status in each["status"]),
    )
    (status,) = [each for each in said["status"] if each["name"] == f"m2pem: link {CAMERA}"]
    assert {"pan_deg", "tilt_deg", "zoom"} <= {each["key"] for each in status["values"]}


async def test_what_a_lost_camera_saw_is_wiped_out(world: World, client: Client) -> None:
    def points(each: Message) -> int:
        return len(each["polygon"]["points"])

    await client.hears("footprints/ugv2/camera", lambda each: points(each) == 4)
    since = len(client.said)
    async with said(world, PayloadState(CAMERA, 0, link=LinkState.LOST)):
        await client.hears("footprints/ugv2/camera", lambda each: points(each) == 0, since=since)


async def test_who_comes_late_hears_what_a_camera_sees(world: World, client: Client) -> None:
    await client.hears("footprints/ugv2/camera", lambda each: True)
    late = Client(client.domain)
    try:
        await late.hears("footprints/ugv2/camera", lambda each: len(each["polygon"]["points"]) == 4)
    finally:
        late.close()


async def test_operators_hear_how_a_team_marches_and_that_it_does_no_more(
    world: World, client: Client
) -> None:
    await client.hears("teams", lambda each: each["teams"] == [])
    members = (
        TeamMemberState(ResourceId("ugv1"), 0.0, -0.5),
        TeamMemberState(ResourceId("ugv2"), -4.5, 0.25, 19.5),
    )
    async with said(world, TeamState("r1.b1", "road_sweep", 5, members, 15.0)):
        heard = await client.hears("teams", lambda each: len(each["teams"]) == 1)
    (team,) = heard["teams"]
    assert (team["behavior"], team["name"], team["spacing_m"]) == ("r1.b1", "road_sweep", 15.0)
    lead, other = team["members"]
    assert (lead["vehicle"], lead["aside_m"]) == ("ugv1", -0.5)
    assert math.isnan(lead["gap_m"])
    assert (other["along_m"], other["aside_m"], other["gap_m"]) == (-4.5, 0.25, 19.5)
    since = len(client.said)
    await client.hears("teams", lambda each: each["teams"] == [], since=since)


def test_a_lost_payload_is_said_to_operators_and_by_no_node() -> None:
    state = PayloadState(CAMERA, 0, link=LinkState.LOST, behavior="zoom")
    told = write_payload_status(msg, state, to_operators=True)
    assert (told.link, told.behavior) == (msg.PayloadStatus.LOST, "zoom")
    assert math.isnan(told.pan_rad)
    of_node = write_payload_status(msg, state)
    assert (of_node.link, of_node.behavior) == (msg.PayloadStatus.NOT_SAID, "")


def test_what_is_not_known_of_a_member_is_no_number() -> None:
    message = team_status(TeamState("b", "escort", 0, (TeamMemberState(ResourceId("a")),), 5.0))
    (member,) = message.members
    assert all(map(math.isnan, (member.along_m, member.aside_m, member.gap_m)))


def test_topics_of_footprints_are_names_that_ros_takes_and_all_different() -> None:
    names = ["ugv-1/ptz.cam", "ugv.1/ptz-cam", "2nd/9", "vögel/auge", "a__b/_"]
    outlines = Outlines([ResourceId(name) for name in names])
    topics = [outlines.topic(ResourceId(name)) for name in names]
    assert topics[:3] == [
        "footprints/ugv_1/ptz_cam",
        "footprints/ugv_1/ptz_cam2",
        "footprints/n2nd/n9",
    ]
    assert len(set(topics)) == len(names)
    for topic in topics:
        validate_topic_name(topic)
