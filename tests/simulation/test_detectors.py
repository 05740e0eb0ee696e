import pytest

from m2pem.api.telemetry import Detection, PayloadState, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.arbiters import SimArbiter
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.arbiter_harness import ArbiterHarness
from tests.simulation.conftest import START_US, Simulate, local, place, position, route

S = 1_000_000
GPR = "ugv/gpr"
UGV = ("ground", {"heading": "90 deg"})


def found(bench: ArbiterHarness) -> list[Detection]:
    return [
        detection
        for state in bench.states
        if isinstance(state, PayloadState)
        for detection in state.detections
    ]


def test_a_planned_detection_comes_at_its_time_where_the_vehicle_is(simulate: Simulate) -> None:
    detector = {"detector": True, "detections": [{"at": "12 s", "type": "gpr"}]}

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=route((100, 0)))
        await bench.until(lambda: bool(found(bench)), 100)
        assert bench.clock.now_us() == START_US + 12 * S
        [detection] = found(bench)
        assert (detection.type, detection.source, detection.time_us) == (
            "gpr",
            GPR,
            START_US + 12 * S,
        )
        gone_m = 12 * 5 - 5 * 5 / 1.5 / 2
        assert local(detection.position) == pytest.approx((gone_m, 0), abs=0.01)

    simulate({"ugv": UGV, GPR: ("ground", detector)}, main)


def test_a_planned_detection_may_say_its_position(simulate: Simulate) -> None:
    planned = {"at": 3, "type": "gpr", "position": [38.2, -77.3, 61.0]}

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.clock.sleep(3.1)
        [detection] = found(bench)
        assert detection.position.latitude_deg == 38.2
        assert detection.position.altitude_m == 61.0

    simulate({"ugv": UGV, GPR: ("ground", {"detector": True, "detections": [planned]})}, main)


def test_a_planted_target_is_found_once_when_it_comes_into_range(simulate: Simulate) -> None:
    latitude, longitude, _ = place(80, 3)
    detector = {
        "detector": True,
        "targets": [{"type": "mine", "position": [latitude, longitude]}],
        "range": "5 m",
    }

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        there_and_back = route((100, 0), (0, 0), (100, 0))
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=there_and_back)
        await bench.until(lambda: bool(found(bench)), 1000)
        # In range from 4 m before it: 5 m of range, 3 m aside.
        seconds = (bench.clock.now_us() - START_US) / S
        assert seconds == pytest.approx(76 / 5 + 5 / 1.5 / 2, abs=0.05)
        await bench.ended("r1.b1", 1000)
        assert [detection.type for detection in found(bench)] == ["mine"]

    simulate({"ugv": UGV, GPR: ("ground", detector)}, main)


def test_a_target_that_is_never_near_is_never_found(simulate: Simulate) -> None:
    latitude, longitude, _ = place(50, 6)
    detector = {
        "detector": True,
        "targets": [{"type": "mine", "position": [latitude, longitude]}],
        "range": "5.9 m",
    }

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=route((100, 0)))
        await bench.ended("r1.b1", 1000)
        assert found(bench) == []

    simulate({"ugv": UGV, GPR: ("ground", detector)}, main)


def test_a_pause_delays_finding_a_planted_target(simulate: Simulate) -> None:
    latitude, longitude, _ = place(80, 0)
    detector = {"detector": True, "targets": [{"type": "m", "position": [latitude, longitude]}]}

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        await bench.start("r1.b1", "single_vehicle_routing", "ugv", route=route((100, 0)))
        await bench.clock.sleep(8)
        await arbiter.hold(ResourceId("ugv"))
        await bench.clock.sleep(500)
        assert found(bench) == []
        await arbiter.resume(ResourceId("ugv"))
        await bench.until(lambda: bool(found(bench)), 100)
        seconds = (bench.clock.now_us() - START_US) / S
        assert seconds == pytest.approx(500 + 75 / 5 + 5 / 1.5 / 2, abs=0.05)

    simulate({"ugv": UGV, GPR: ("ground", detector)}, main)


def test_a_payload_that_is_no_detector_finds_nothing(simulate: Simulate) -> None:
    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        await bench.clock.sleep(10)
        assert found(bench) == []

    simulate({"ugv": UGV, GPR: ("ground", {"detections": [{"at": 1, "type": "gpr"}]})}, main)


def test_a_detection_without_a_link_is_heard_when_it_is_mended(simulate: Simulate) -> None:
    detector = {"detector": True, "detections": [{"at": 5, "type": "gpr"}]}

    async def main(bench: ArbiterHarness, arbiter: SimArbiter) -> None:
        arbiter.lose_link(ResourceId("ugv"))
        await bench.clock.sleep(20)
        assert found(bench) == []
        arbiter.restore_link(ResourceId("ugv"))
        await bench.clock.sleep(1)
        assert [detection.time_us for detection in found(bench)] == [START_US + 5 * S]

    simulate({"ugv": UGV, GPR: ("ground", detector)}, main)


def test_a_detector_on_a_vehicle_elsewhere_hears_of_it_on_the_bus(simulate: Simulate) -> None:
    latitude, longitude, _ = place(50, 0)
    detector = {"detector": True, "targets": [{"type": "m", "position": [latitude, longitude]}]}

    bus = Bus()

    async def main(bench: ArbiterHarness, _: SimArbiter) -> None:
        for east in (0.0, 30.0, 48.0):
            await bench.clock.sleep(1)
            now_us = bench.clock.now_us()
            bus.publish(VehicleState(ResourceId("stranger"), now_us, position(east, 0)))
        await bench.until(lambda: bool(found(bench)), 1)
        assert [detection.time_us for detection in found(bench)] == [START_US + 3 * S]

    simulate({"stranger/gpr": ("ground", detector)}, main, bus=bus)
