import pymap3d
import pytest
from m2pem_plugin_mavlink.simulator.geometry import LocalFrame, Location, Point

PLACES = [(47.397742, 8.545594), (-33.9, 151.2), (0.0, 179.9999), (69.6, -18.9)]


@pytest.mark.parametrize("place", PLACES)
def test_to_earth_and_back_loses_nothing(place: tuple[float, float]) -> None:
    frame = LocalFrame(Location(*place, 100.0))
    point = Point(1234.5, -678.9, 42.0)
    location = frame.to_location(point)
    assert frame.to_point(location) == pytest.approx(point, abs=1e-6)
    assert -180 <= location.longitude_deg < 180


@pytest.mark.parametrize("place", PLACES)
def test_metres_agree_with_geodesy(place: tuple[float, float]) -> None:
    location = LocalFrame(Location(*place, 0.0)).to_location(Point(600.0, -800.0, 0.0))
    east, north, _ = pymap3d.geodetic2enu(*location, *place, 0.0)
    assert (float(north), float(east)) == pytest.approx((600, -800), abs=0.3)
