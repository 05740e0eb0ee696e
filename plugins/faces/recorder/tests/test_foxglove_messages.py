"""Messages of Foxglove, decoded with its own schemas."""

from typing import Any

import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from m2pem_plugin_recorder.foxglove_messages import footprint_messages, scene_message

from m2pem.api import GeoPosition, LocalFrame, PayloadState, Point, Route

ORIGIN = (38.1075, -77.3192, 60.0)
FRAME = LocalFrame(ORIGIN)


def entity(data: bytes) -> Any:
    (found,) = SceneUpdate.FromString(data).entities
    return found


@pytest.mark.parametrize(
    ("altitude_m", "frame", "up_m"),
    [
        (250.0, "amsl", 190.0),
        (20.0, "relative", 20.0),
        (20.0, "terrain", 20.0),
        (None, "amsl", 0.0),
    ],
)
def test_geometries_are_drawn_at_their_altitudes(
    altitude_m: float | None, frame: str, up_m: float
) -> None:
    place = (*ORIGIN[:2], altitude_m)
    for geometry in (Point(place, frame), Route((place, place), frame)):
        message = scene_message("way", geometry, FRAME, 0)
        assert message is not None
        assert entity(message.data).texts[0].pose.position.z == pytest.approx(up_m)


def test_each_waypoint_is_drawn_in_its_own_altitude_frame() -> None:
    route = Route.of([(*ORIGIN[:2], 100.0), (*ORIGIN[:2], 40.0)], ["amsl", "relative"])
    message = scene_message("way", route, FRAME, 0)
    assert message is not None
    assert [each.z for each in entity(message.data).lines[0].points] == pytest.approx([40, 40])


def test_footprints_are_drawn_at_their_altitudes() -> None:
    state = PayloadState("uav1/camera", 0, footprint=(GeoPosition(*ORIGIN[:2], 55.0),))
    (message,) = footprint_messages(state, FRAME)
    assert entity(message.data).lines[0].points[0].z == pytest.approx(-5)
