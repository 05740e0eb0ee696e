"""The coordinate spaces of the simulated camera: what it says of them, and what they mean."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from m2pem_plugin_ptz.sim.onvif.soap import FaultError
from m2pem_plugin_ptz.sim.onvif.specification import CameraSpec

_BASE = "http://www.onvif.org/ver10/tptz"
GENERIC = f"{_BASE}/PanTiltSpaces/PositionGenericSpace"
DEGREES = f"{_BASE}/PanTiltSpaces/SphericalPositionSpaceDegrees"
VELOCITY = f"{_BASE}/PanTiltSpaces/VelocityGenericSpace"
VELOCITY_DEGREES = f"{_BASE}/PanTiltSpaces/VelocitySpaceDegrees"
SPEED = f"{_BASE}/PanTiltSpaces/GenericSpeedSpace"
SPEED_DEGREES = f"{_BASE}/PanTiltSpaces/SpeedSpaceDegrees"
ZOOM = f"{_BASE}/ZoomSpaces/PositionGenericSpace"
ZOOM_MILLIMETRES = f"{_BASE}/ZoomSpaces/PositionSpaceMillimeter"
ZOOM_VELOCITY = f"{_BASE}/ZoomSpaces/VelocityGenericSpace"
ZOOM_SPEED = f"{_BASE}/ZoomSpaces/ZoomGenericSpeedSpace"

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Space:
    """A kind of space as a PTZ node lists it."""

    kind: str
    uri: str
    x: Range
    y: Range | None = None

    def xml(self) -> str:
        """Its description."""
        ranges = _range("XRange", self.x) + ("" if self.y is None else _range("YRange", self.y))
        return f"<tt:{self.kind}><tt:URI>{self.uri}</tt:URI>{ranges}</tt:{self.kind}>"


def _range(name: str, ends: Range) -> str:
    return f"<tt:{name}><tt:Min>{ends[0]}</tt:Min><tt:Max>{ends[1]}</tt:Max></tt:{name}>"


def spaces(spec: CameraSpec) -> Iterator[Space]:
    """All of a camera, in the order of the schema."""
    both, rate = (-1.0, 1.0), spec.rate_deg_s
    if spec.turns:
        yield Space("AbsolutePanTiltPositionSpace", GENERIC, both, both)
        if spec.degrees:
            yield Space("AbsolutePanTiltPositionSpace", DEGREES, spec.pan_deg, spec.tilt_deg)
    yield Space("AbsoluteZoomPositionSpace", ZOOM, (0.0, 1.0))
    if spec.degrees:
        far = spec.focal_mm * spec.zoom_max
        yield Space("AbsoluteZoomPositionSpace", ZOOM_MILLIMETRES, (spec.focal_mm, far))
    if spec.drives:
        yield Space("ContinuousPanTiltVelocitySpace", VELOCITY, both, both)
        if spec.degrees:
            ends = (-rate, rate)
            yield Space("ContinuousPanTiltVelocitySpace", VELOCITY_DEGREES, ends, ends)
        yield Space("ContinuousZoomVelocitySpace", ZOOM_VELOCITY, both)
    yield Space("PanTiltSpeedSpace", SPEED, (0.0, 1.0))
    if spec.degrees:
        yield Space("PanTiltSpeedSpace", SPEED_DEGREES, (0.0, rate))
    yield Space("ZoomSpeedSpace", ZOOM_SPEED, (0.0, 1.0))


def meaning(spec: CameraSpec, uri: str, x: float, axis: str) -> float:
    """A number of a space in rad, rad/s or as a zoom factor. `axis`: "pan", "tilt" or "zoom".

    Raises:
        FaultError: there is no such space, or the number is outside.
    """
    space = next((each for each in spaces(spec) if each.uri == uri), None)
    if space is None:
        raise FaultError(f"there is no space {uri}", "InvalidArgVal", "SpaceNotSupported")
    low, high = space.y if axis == "tilt" and space.y is not None else space.x
    if not low - 1e-6 <= x <= high + 1e-6:
        raise FaultError(f"{x} is not in {low} to {high}", "InvalidArgVal", "InvalidPosition")
    if uri in (DEGREES, VELOCITY_DEGREES, SPEED_DEGREES):
        return math.radians(x)
    if uri == ZOOM_MILLIMETRES:
        return x / spec.focal_mm
    if uri == ZOOM:
        return 1.0 + x * (spec.zoom_max - 1.0)
    if uri in (VELOCITY, SPEED):
        return x * math.radians(spec.rate_deg_s)
    if uri in (ZOOM_VELOCITY, ZOOM_SPEED):
        return x * spec.head().zoom.rate
    ends = spec.tilt_deg if axis == "tilt" else spec.pan_deg
    return math.radians(ends[0] + (x + 1.0) / 2 * (ends[1] - ends[0]))


def share(spec: CameraSpec, value: float, axis: str) -> float:
    """An angle in rad, or a zoom factor, in the generic space."""
    if axis == "zoom":
        return (value - 1.0) / max(spec.zoom_max - 1.0, 1e-9)
    ends = spec.tilt_deg if axis == "tilt" else spec.pan_deg
    return (math.degrees(value) - ends[0]) / (ends[1] - ends[0]) * 2 - 1.0
