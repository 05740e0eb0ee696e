"""The parts that need no DDS: pace, settings, and what diagnostics say."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from m2pem_plugin_mocu.diagnostics import Health, Vehicles, diagnostics, site_of
from m2pem_plugin_mocu.publish_throttle import MAX_PERIOD_S, MIN_PERIOD_S, PublishThrottle
from m2pem_plugin_mocu.settings import SettingError, namespace
from m2pem_plugin_ros import one_line, sendable, stays_on_loopback
from mocu_world import fleet

from m2pem.api import (
    LinkState,
    ResourceId,
    VehicleState,
)

OK, WARN, ERROR, STALE = b"\0", b"\1", b"\2", b"\3"
UGV1 = ResourceId("ugv1")

Virtual = Callable[[Callable[[Any], Awaitable[list[int]]]], list[int]]


# --- pace -----------------------------------------------------------------------------------------


def said_while(virtual: Virtual, changes: int, every_s: float) -> list[int]:
    """What is said of a number that is changed so often."""

    async def main(clock: Any) -> list[int]:
        number = 0
        said: list[int] = []

        async def say() -> None:
            said.append(number)
            if number == 3:
                raise ValueError("cannot be said")

        throttle = PublishThrottle(say)
        running = asyncio.create_task(throttle.run())
        for _ in range(changes):
            await clock.sleep(every_s)
            number += 1
            throttle.mark_changed()
        await clock.sleep(MAX_PERIOD_S)
        running.cancel()
        return said

    return virtual(main)


def test_a_thousand_changes_a_second_are_said_ten_times_a_second(virtual: Virtual) -> None:
    said = said_while(virtual, 10_000, 0.001)
    assert len(said) <= 11 / MIN_PERIOD_S
    assert said[-1] == 10_000
    assert said == sorted(said)


def test_what_does_not_change_is_said_once_a_second(virtual: Virtual) -> None:
    said = said_while(virtual, 1, 10.0)
    assert 10 <= len(said) <= 13


def test_what_cannot_be_said_does_not_silence_what_comes_after(virtual: Virtual) -> None:
    assert said_while(virtual, 5, 2.0)[-1] == 5


# --- settings and texts ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("said", "meant"), [("", "/m2pem"), ("team_a/m2pem", "/team_a/m2pem"), ("/x/", "/x")]
)
def test_the_namespace_may_be_said(said: str, meant: str) -> None:
    assert namespace({"M2PEM_ROS_NAMESPACE": said}) == meant


@pytest.mark.parametrize("said", ["a b", "9", "a//b", "a__b", "ä"])
def test_what_is_no_namespace_is_refused(said: str) -> None:
    with pytest.raises(SettingError, match="M2PEM_ROS_NAMESPACE"):
        namespace({"M2PEM_ROS_NAMESPACE": said})


@pytest.mark.parametrize(
    ("said", "simulated", "stays"),
    [("", True, True), ("", False, False), ("1", False, True), ("0", True, False)],
)
def test_dds_stays_where_nothing_real_moves(said: str, simulated: bool, stays: bool) -> None:
    assert stays_on_loopback({"M2PEM_ROS_LOOPBACK": said}, simulated=simulated) is stays


def test_texts_are_made_fit_for_messages() -> None:
    assert sendable("a\0b\ud800") == "a\N{REPLACEMENT CHARACTER}b?"
    assert one_line(" two\n lines \x1b[31m") == "two lines ?[31m"


# --- diagnostics ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("state", "level", "says"),
    [
        (VehicleState(UGV1, 0, battery_fraction=0.9), OK, "received"),
        (VehicleState(UGV1, 0, battery_fraction=0.1), WARN, "battery at 10%"),
        (VehicleState(UGV1, 0, ready=False, not_ready_reasons=("no GPS",)), WARN,
         "not ready: no GPS"),
        (VehicleState(UGV1, 0, link=LinkState.DEGRADED), WARN, "link degraded"),
        (VehicleState(UGV1, 0, link=LinkState.LOST), ERROR, "link lost"),
    ],
)  # fmt: skip
def test_a_vehicle_is_told_as_it_is(state: VehicleState, level: bytes, says: str) -> None:
    vehicles = Vehicles(fleet())
    vehicles.receive(state)
    first, second = vehicles.statuses()
    assert (first.level, first.message) == (level, says)
    assert (second.level, second.message) == (STALE, "nothing received yet")


@pytest.mark.parametrize(
    ("namespace", "site"), [("/m2pem", ""), ("/team_a/m2pem", "team_a/m2pem/"), ("/b", "b/")]
)
def test_names_of_two_namespaces_differ(namespace: str, site: str) -> None:
    health = Health("fleet", 0.0, 1, 0, 0, 0, 0, 0, 0.0)
    statuses = diagnostics(health, Vehicles(fleet(), site_of(namespace)), 0).status
    assert [each.name for each in statuses[:3]] == [
        f"m2pem: {site}executive", f"m2pem: {site}journal", f"m2pem: link {site}ugv1"
    ]  # fmt: skip
    assert statuses[2].hardware_id == f"{site}ugv1"


def test_two_executives_in_one_namespace_are_an_error() -> None:
    health = Health("fleet", 0.0, 2, 0, 0, 0, 0, 0, 0.0)
    executive, journal = diagnostics(health, Vehicles(fleet()), 0).status[:2]
    assert executive.level == ERROR
    assert "2 executives serve this namespace" in executive.message
    assert journal.level == OK
