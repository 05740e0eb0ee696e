"""Robots that drive by themselves are cut off, their executive is killed, and they are back and
drive on: over DDS, by the topics and the action of an m2pem node, and by Nav2.

Their process is stopped by a signal meanwhile: it neither receives nor sends. When it goes on, they
do what they did before, and know no new executive.
"""

import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

import pytest
import rclpy
from m2pem_interfaces.msg import FleetResource, FleetState
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from ros_e2e_programs import Program, Programs
from ros_e2e_watch import Watch
from ros_e2e_world import ALL_WAYS, convoy, fleet_file
from ros_face_client import LATCHED

SPEED = 4.0
LENGTH_M = 400.0
WATCHED: Mapping[str, Mapping[str, Any]] = {
    name: way for name, way in ALL_WAYS.items() if name != "base"
}
"""A base is at rest without its executive."""

ROLE = "onLoss='reassign' wait='unlimited' requires=\"vehicle.name == 'NAME'\""
"""A vehicle that is lost is to do the rest itself."""


LOST, CONNECTED = FleetResource.LOST, FleetResource.CONNECTED


@contextmanager
def face_states(domain: int) -> Iterator[list[Any]]:
    """What a node of ROS receives of the face: the states of the fleet."""
    received: list[Any] = []
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("station", context=context)
    node.create_subscription(FleetState, "/face/fleet_state", received.append, LATCHED)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    spinning = threading.Thread(target=spin, daemon=True)
    spinning.start()
    try:
        yield received
    finally:
        rclpy.try_shutdown(context=context)
        spinning.join()
        node.destroy_node()


def cut_off_and_killed(
    m2pem: Programs, watch: Watch, lost_after: str, *, noticed: bool, stands_by: bool = False
) -> tuple[Program, Program]:
    """The vehicles are cut off on their ways, and the executive killed, before or after it has
    noticed that. Returns the vehicles, which are silent, and the next executive; `stands_by`:
    whether that waits from the beginning."""
    fleet = fleet_file(m2pem.folder, WATCHED, LENGTH_M, lost_after=lost_after, faces={"ros": {}})
    simulated = m2pem.simulate(fleet, SPEED)
    watch.until_heard()
    mission = convoy(m2pem.folder, WATCHED, role=ROLE)
    if stands_by:
        words = ("--fleet", fleet, "--speed", f"{SPEED:g}", "--ocu", "none", "--format", "json")
        first = m2pem.m2pem("serve", *words)
        first.until_line("serving")
        again = m2pem.m2pem("serve", *words, "--standby")
        again.until_line("standing by for")
        assert m2pem.m2pem("start", mission).rest() == 0
    else:
        first = m2pem.run(mission, fleet, SPEED)
    first.until_record("BehaviorProgressed", len(WATCHED), state="RUNNING")
    watch.until(lambda: all(track.north_m > 5.0 for _, track in watch.items()))
    simulated.process.send_signal(signal.SIGSTOP)
    if noticed:
        first.until_record("WorkReassigned", len(WATCHED))
    first.kill()
    if not stands_by:
        again = m2pem.m2pem("resume", "r1", "--ocu", "none", "--format", "json")
    again.until_record("RunClaimed")
    return simulated, again


@pytest.mark.long
def test_robots_whose_loss_was_journaled_are_stopped_before_anything_else(
    m2pem: Programs, watch: Watch
) -> None:
    simulated, again = cut_off_and_killed(m2pem, watch, "10 s", noticed=True)
    assert not again.those("ResourceReturned")
    simulated.process.send_signal(signal.SIGCONT)
    for name in WATCHED:
        again.until_record("ResourceReturned", resource=name, code="LINK_LOST")
    again.until_record("BehaviorRequested", len(WATCHED))
    for name in WATCHED:
        (returned,) = again.those("ResourceReturned", resource=name)
        (asked,) = again.those("BehaviorRequested", element=f"Drive_{name}")
        assert again.records.index(returned) < again.records.index(asked)
        assert any(track.forward_m_s < 0.01 for track in watch[name].odometry[-400:])


@pytest.mark.long
def test_robots_whose_loss_nothing_had_noticed_are_held_until_an_operator_decides(
    m2pem: Programs, watch: Watch
) -> None:
    simulated, again = cut_off_and_killed(m2pem, watch, "1000 s", noticed=False)
    again.until_record("BehaviorUnsettled", len(WATCHED))
    simulated.process.send_signal(signal.SIGCONT)
    watch.until(lambda: all(track.stands for _, track in watch.items()))
    where = {name: track.north_m for name, track in watch.items()}
    assert all(5.0 < north_m < LENGTH_M - 20.0 for north_m in where.values()), where
    assert not again.those("BehaviorRequested")


@pytest.mark.parametrize("stands_by", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_face_of_the_next_executive_says_at_once_that_a_robot_is_lost(
    m2pem: Programs, watch: Watch, ros_domain: int, stands_by: bool
) -> None:
    with face_states(ros_domain) as states:
        simulated, _ = cut_off_and_killed(m2pem, watch, "10 s", noticed=True, stands_by=stands_by)

        def shown() -> list[Any]:
            return [each for state in states[-1:] for each in state.resources]

        lost = "lost: the link was lost before a restart, when it did r1."
        watch.until(
            lambda: (
                shown()
                and all(
                    each.link == each.LOST
                    and each.readiness == each.NOT_READY
                    and each.not_ready_reasons[0].startswith(lost)
                    for each in shown()
                )
            )
        )
        first = next(each for each in states if lost in str(each))
        later = states[states.index(first) :]
        assert {each.link for state in later for each in state.resources} == {LOST}
        simulated.process.send_signal(signal.SIGCONT)
        watch.until(lambda: {each.link for each in shown()} == {CONNECTED})
