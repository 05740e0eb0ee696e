import asyncio
import logging

import pytest

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.api.telemetry import Detection, GeoPosition, PayloadState, VehicleState
from m2pem.mission.catalogue import ResourceId
from m2pem.services.detector import Detector
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.service import START_US, ServiceCase, ServiceContract, run_case

GPR, OTHER, CAMERA = ResourceId("evsg1/gpr"), ResourceId("evsg2/gpr"), ResourceId("evsg1/ptz")
FLEET = (GPR, OTHER)


def found(payload: ResourceId, *types: str) -> PayloadState:
    position = GeoPosition(38.1, -77.3, 61.5)
    time_us = START_US + 12_500_000
    return PayloadState(
        payload,
        time_us=time_us,
        detections=tuple(Detection(type_, payload, position, time_us) for type_ in types),
    )


def written(case: ServiceCase) -> dict[str, object]:
    result = run_case(Detector(), case)
    assert not isinstance(result, ServiceError)
    return dict(result)


class TestDetectorContract(ServiceContract):
    @pytest.fixture
    def service(self) -> Service:
        return Detector()

    @pytest.fixture
    def case(self) -> ServiceCase:
        return ServiceCase(detectors=FLEET, published=[(5.0, found(GPR, "gpr"))])


def test_detection_is_written_with_its_source_place_and_time() -> None:
    case = ServiceCase(detectors=FLEET, published=[(5.0, found(GPR, "gpr"))])
    assert written(case) == {
        "detection.type": "gpr",
        "detection.source": "evsg1/gpr",
        "detection.position": [38.1, -77.3, 61.5],
        "detection.time": "2026-01-01T00:00:12.500000Z",
    }


def test_without_roles_any_detector_payload_of_the_fleet_is_heard() -> None:
    case = ServiceCase(
        detectors=FLEET, published=[(1.0, found(CAMERA, "smoke")), (1.0, found(OTHER, "metal"))]
    )
    assert written(case)["detection.source"] == "evsg2/gpr"


def test_with_a_role_only_its_payload_is_heard() -> None:
    case = ServiceCase(
        roles={"scanner": OTHER},
        detectors=FLEET,
        published=[(1.0, found(GPR, "gpr")), (1.0, found(OTHER, "metal"))],
    )
    assert written(case)["detection.type"] == "metal"


def test_a_role_may_name_a_payload_that_is_not_marked_as_a_detector() -> None:
    case = ServiceCase(roles={"eye": CAMERA}, published=[(1.0, found(CAMERA, "smoke"))])
    assert written(case)["detection.source"] == "evsg1/ptz"


def test_a_role_that_names_a_vehicle_means_its_detector_payloads() -> None:
    case = ServiceCase(
        roles={"driver": ResourceId("evsg2")},
        detectors=FLEET,
        published=[
            (1.0, found(GPR, "gpr")),
            (1.0, found(CAMERA, "smoke")),
            (1.0, found(OTHER, "tin")),
        ],
    )
    assert written(case)["detection.type"] == "tin"


def test_states_without_detections_are_passed_over_and_the_first_detection_counts() -> None:
    vehicle = VehicleState(ResourceId("evsg1"), time_us=0)
    case = ServiceCase(
        detectors=FLEET,
        published=[(1.0, vehicle), (1.0, found(GPR)), (1.0, found(GPR, "tin", "gpr"))],
    )
    assert written(case)["detection.type"] == "tin"


def test_what_was_detected_before_the_task_started_does_not_count() -> None:
    async def main(clock: VirtualClock) -> object:
        bus = Bus()
        bus.publish(found(GPR, "early"))
        context = ServiceContext(clock, bus, logging.getLogger(), FLEET)
        running = asyncio.create_task(Detector().run(context, {}, {}))
        await clock.sleep(10)
        bus.publish(found(GPR, "late"))
        return (await running)["detection.type"]

    assert run_virtual(main, START_US) == "late"


@pytest.mark.parametrize(
    ("roles", "message"),
    [
        ({}, "no payload of the fleet"),
        ({"driver": ResourceId("uav1")}, "no detector payload on uav1"),
    ],
)
def test_waiting_for_nothing_is_said_and_still_waits(
    roles: dict[str, ResourceId], message: str, caplog: pytest.LogCaptureFixture
) -> None:
    case = ServiceCase(roles=roles, published=[(1.0, found(CAMERA, "smoke"))])
    with pytest.raises(AssertionError, match="had not ended"):
        run_case(Detector(), case)
    assert message in caplog.text


def test_end_of_telemetry_is_an_error_that_the_mission_can_catch() -> None:
    async def main(clock: VirtualClock) -> None:
        bus = Bus()
        bus.close()
        await Detector().run(ServiceContext(clock, bus, logging.getLogger(), FLEET), {}, {})

    with pytest.raises(ServiceError) as raised:
        run_virtual(main, START_US)
    assert raised.value.code == "FAILED"
