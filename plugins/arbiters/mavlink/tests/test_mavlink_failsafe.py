import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from m2pem_plugin_mavlink.vehicle.failsafe import (
    FailsafeMonitor,
    findings,
    parameters_of_interest,
)
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind
from mavlink_vehicle_world import Playing, ScriptedLink, copter, make
from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import Clock, ResourceId

Run = Callable[[Callable[[Clock], Any]], Any]

UAV1 = ResourceId("uav1")
COPTER = Identity(Firmware.ARDUPILOT, Kind.COPTER)
PLANE = Identity(Firmware.ARDUPILOT, Kind.PLANE)
ROVER = Identity(Firmware.ARDUPILOT, Kind.ROVER)
PX4 = Identity(Firmware.PX4, Kind.COPTER)
GOOD = {"FS_GCS_ENABLE": 1.0, "BATT_FS_LOW_ACT": 2.0, "FS_THR_ENABLE": 1.0, "RTL_ALT": 1500.0}


def found(word: str, who: Identity, values: dict[str, float], own: int | None = None) -> list[str]:
    return [str(each) for each in findings(UAV1, word, who, values, own)]


def test_a_vehicle_that_is_set_as_the_fleet_says_has_no_findings() -> None:
    assert found("return_to_launch", COPTER, GOOD) == []
    assert found("hold", ROVER, {"FS_GCS_ENABLE": 1.0, "FS_ACTION": 2.0}) == []
    assert found("land", PX4, {"NAV_DLL_ACT": 3.0, "COM_LOW_BAT_ACT": 3.0}) == []
    assert found("continue", COPTER, {**GOOD, "FS_GCS_ENABLE": 0.0}) == []
    assert found("return_to_launch", PLANE, {"FS_GCS_ENABL": 1.0, "FS_LONG_ACTN": 1.0}) == []


def test_a_fleet_that_says_nothing_gets_no_findings() -> None:
    assert found("", COPTER, {"FS_GCS_ENABLE": 0.0}) == []


@pytest.mark.parametrize(
    ("word", "who", "values", "text"),
    [
        (
            "return_to_launch",
            COPTER,
            {**GOOD, "FS_GCS_ENABLE": 0.0},
            "uav1: fleet says return_to_launch on loss of link, FS_GCS_ENABLE is 0 (disabled): "
            "set it to 1",
        ),
        (
            "land",
            COPTER,
            {"FS_GCS_ENABLE": 1.0},
            "uav1: fleet says land on loss of link, FS_GCS_ENABLE is 1 (return to launch): "
            "set it to 5",
        ),
        (
            "hold",
            ROVER,
            {"FS_GCS_ENABLE": 1.0, "FS_ACTION": 1.0},
            "uav1: fleet says hold on loss of link, FS_ACTION is 1 (return to launch): set it to 2",
        ),
        (
            "return_to_launch",
            PX4,
            {"NAV_DLL_ACT": 0.0},
            "uav1: fleet says return_to_launch on loss of link, NAV_DLL_ACT is 0 (disabled): "
            "set it to 2",
        ),
        (
            "land",
            ROVER,
            {"FS_GCS_ENABLE": 1.0},
            "uav1: fleet says land on loss of link, which no ArduPilot rover supports",
        ),
        (
            "land",
            PX4,
            {},
            "uav1: fleet says land on loss of link; NAV_DLL_ACT could not be read",
        ),
        (
            "come_home",
            PX4,
            {},
            "uav1: failsafe 'come_home' is not known for MAVLink vehicles; "
            "known: return_to_launch, land, hold, continue",
        ),
    ],
)
def test_a_disagreement_is_found(
    word: str, who: Identity, values: dict[str, float], text: str
) -> None:
    assert found(word, who, values) == [text]


def test_a_failsafe_that_watches_another_station_is_found() -> None:
    values = {**GOOD, "MAV_GCS_SYSID": 255.0}
    assert found("return_to_launch", COPTER, values, 255) == []
    (text,) = found("return_to_launch", COPTER, values, 245)
    assert "monitors the ground station with system id 255 (MAV_GCS_SYSID), m2pem has 245" in text


@pytest.mark.parametrize(
    ("change", "parameter"),
    [
        ({"BATT_FS_LOW_ACT": 0.0}, "BATT_FS_LOW_ACT"),
        ({"FS_OPTIONS": 2.0}, "FS_OPTIONS"),
        ({"FS_OPTIONS": 16.0}, "FS_OPTIONS"),
        ({"FS_OPTIONS": 8.0}, ""),
        ({"FS_THR_ENABLE": 4.0}, ""),
        ({"FS_THR_ENABLE": 3.0}, "FS_THR_ENABLE"),
        ({"FS_THR_ENABLE": 5.0}, "FS_THR_ENABLE"),
        ({"RTL_ALT": 0.0}, "RTL_ALT"),
    ],
)
def test_what_goes_with_a_return_is_looked_at(change: dict[str, float], parameter: str) -> None:
    found = findings(UAV1, "return_to_launch", COPTER, {**GOOD, **change})
    assert [each.parameter for each in found] == ([parameter] if parameter else [])


@pytest.mark.parametrize("firmware", Firmware)
@pytest.mark.parametrize("kind", Kind)
def test_every_vehicle_has_parameters_to_look_at(firmware: Firmware, kind: Kind) -> None:
    assert len(parameters_of_interest(Identity(firmware, kind))) >= 2


def answers(link: ScriptedLink, values: dict[str, float]) -> list[str]:
    """The vehicle has these parameters; returns the names that are requested, as they come."""
    requested: list[str] = []
    send = link.send

    def take(message: Any) -> None:
        send(message)
        if message.TYPE.name != "PARAM_REQUEST_READ":
            return
        name = bytes(message.param_id).rstrip(b"\0").decode()
        requested.append(name)
        if name in values:
            asyncio.get_running_loop().call_soon(reports, link, name, values[name])

    link.send = take  # type: ignore[method-assign]
    return requested


def reports(link: ScriptedLink, name: str, value: float) -> None:
    kind = dialect.MAV_PARAM_TYPE_REAL32
    fields = {"param_id": name.encode(), "param_value": value, "param_type": kind}
    link.hear(make("PARAM_VALUE", **fields))


def test_a_parameter_that_is_set_later_is_compared_at_once(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            values = dict(GOOD)
            answers(link, values)
            monitor = FailsafeMonitor(vehicle, "return_to_launch", None)
            assert await monitor.findings() == ()
            began_s = link.now_s()
            waits = asyncio.ensure_future(monitor.wait_for_change())
            await clock.sleep(5.0)
            reports(link, "FS_GCS_ENABLE", 1.0)  # as it was
            reports(link, "WP_RADIUS", 3.0)  # none of those
            await clock.sleep(5.0)
            assert not waits.done()
            values["FS_GCS_ENABLE"] = 0.0
            reports(link, "FS_GCS_ENABLE", 0.0)
            await waits
            assert link.now_s() - began_s < 15.0
            (found,) = await monitor.findings()
            assert found.parameter == "FS_GCS_ENABLE"

    virtual(main)


def test_parameters_are_read_again_each_minute_and_missing_ones_once(virtual: Run) -> None:
    async def main(clock: Clock) -> None:
        async with Playing(copter(clock)) as (link, vehicle):
            values = dict(GOOD)
            requested = answers(link, values)
            monitor = FailsafeMonitor(vehicle, "return_to_launch", None)
            await monitor.findings()
            assert {"FS_OPTIONS", "RTL_ALT_M"} <= set(requested)
            requested.clear()
            values["BATT_FS_LOW_ACT"] = 0.0  # the vehicle does not say so
            began_s = link.now_s()
            await monitor.wait_for_change()
            assert 60.0 <= link.now_s() - began_s < 65.0
            (found,) = await monitor.findings()
            assert found.parameter == "BATT_FS_LOW_ACT"
            assert sorted(requested) == sorted(GOOD)
            # A vehicle that does not answer any more has not changed.
            values.clear()
            assert await monitor.findings() == (found,)

    virtual(main)
