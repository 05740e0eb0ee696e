import pymap3d
import pytest

from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.geojson import GeometryError
from m2pem.fleet.local_positions import is_local, local_point
from m2pem.fleet.parameters import ParameterError, resolve
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.geometry import Point

ORIGIN = (38.1075, -77.3192, 60.0)
GOTO = SHARED["goto", BehaviorType.VEHICLE]


def test_east_north_and_up_of_the_origin_are_metres() -> None:
    point = local_point("enu [300, -400.5, 25]", ORIGIN)
    latitude, longitude, altitude = point.position
    assert altitude is not None
    back = pymap3d.geodetic2enu(latitude, longitude, altitude, *ORIGIN)
    assert back == pytest.approx((300.0, -400.5, 25.0), abs=1e-6)
    assert point.altitude_frame == "amsl"


def test_without_up_no_altitude_is_given() -> None:
    latitude, longitude, altitude = local_point(" enu [0, 1000]", ORIGIN).position
    assert (latitude, longitude) == pytest.approx((38.11651, -77.3192), abs=1e-5)
    assert altitude is None


@pytest.mark.parametrize("text", ["enu [1, 2]", "enu[1,2,3]", "  enu  [1"])
def test_what_is_meant_as_local_is_told_from_names(text: str) -> None:
    assert is_local(text)


@pytest.mark.parametrize("text", ["enu", "enugu", "[1, 2]", "menu [1, 2]"])
def test_names_and_other_positions_are_not_local(text: str) -> None:
    assert not is_local(text)


@pytest.mark.parametrize(
    "text",
    ["enu [1", "enu [1]", "enu [1, 2, 3, 4]", "enu [1, true]", "enu [1, NaN]", "enu [1, 2e6]"],
)
def test_what_is_no_place_is_refused(text: str) -> None:
    with pytest.raises(GeometryError):
        local_point(text, ORIGIN)


def test_a_behavior_takes_it_as_a_position() -> None:
    values = resolve(GOTO, {"target": "enu [10, 20]"}, lambda _: None, (), ORIGIN)
    assert isinstance(values["target"], Point)


@pytest.mark.parametrize("origin", [None, (0.0, 0.0, 0.0)])
def test_a_fleet_without_an_origin_is_told_so(origin: tuple[float, float, float] | None) -> None:
    with pytest.raises(ParameterError, match="give the fleet an `origin`"):
        resolve(GOTO, {"target": "enu [10, 20]"}, lambda _: None, (), origin)


def test_a_wrong_one_is_told_with_what_would_be_right() -> None:
    with pytest.raises(ParameterError, match=r"write enu \[east, north, up\]"):
        resolve(GOTO, {"target": "enu [10]"}, lambda _: None, (), ORIGIN)
