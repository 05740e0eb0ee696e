"""The PTZ service: coordinate spaces, status and moves."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

import isodate

from m2pem_plugin_ptz.simulator.onvif.camera import Camera, CameraSpec
from m2pem_plugin_ptz.simulator.onvif.services import CONFIGURATION, NODE, PROFILE, Operations, know
from m2pem_plugin_ptz.simulator.onvif.soap import Element, FaultError

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
    """A space in the list of a PTZ node."""

    kind: str
    uri: str
    x: Range
    y: Range | None = None

    def xml(self) -> str:
        ranges = _range("XRange", self.x) + ("" if self.y is None else _range("YRange", self.y))
        return f"<tt:{self.kind}><tt:URI>{self.uri}</tt:URI>{ranges}</tt:{self.kind}>"


def _range(name: str, ends: Range) -> str:
    return f"<tt:{name}><tt:Min>{ends[0]}</tt:Min><tt:Max>{ends[1]}</tt:Max></tt:{name}>"


def spaces(spec: CameraSpec) -> Iterator[Space]:
    """Yield all spaces of a camera, in the order of the schema."""
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
    """Convert a number of a space to rad, rad/s or a zoom factor. `axis`: "pan", "tilt" or "zoom".

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
        return x * spec.gimbal().zoom.rate
    ends = spec.tilt_deg if axis == "tilt" else spec.pan_deg
    return math.radians(ends[0] + (x + 1.0) / 2 * (ends[1] - ends[0]))


def share(spec: CameraSpec, value: float, axis: str) -> float:
    """Convert an angle in rad, or a zoom factor, to the generic space."""
    if axis == "zoom":
        return (value - 1.0) / max(spec.zoom_max - 1.0, 1e-9)
    ends = spec.tilt_deg if axis == "tilt" else spec.pan_deg
    return (math.degrees(value) - ends[0]) / (ends[1] - ends[0]) * 2 - 1.0


DEFAULT_TIMEOUT_S = 10.0


def configuration(camera: Camera, tag: str) -> str:
    """Return the PTZ configuration of the profile."""
    spec = camera.spec
    defaults = ""
    if spec.turns:
        uri = DEGREES if spec.degrees else GENERIC
        defaults += (
            f"<tt:DefaultAbsolutePantTiltPositionSpace>{uri}"
            "</tt:DefaultAbsolutePantTiltPositionSpace>"
        )
    return (
        f'<{tag} token="{CONFIGURATION}"><tt:Name>ptz</tt:Name><tt:UseCount>1</tt:UseCount>'
        f"<tt:NodeToken>{NODE}</tt:NodeToken>{defaults}"
        f"<tt:DefaultPTZTimeout>PT{DEFAULT_TIMEOUT_S:g}S</tt:DefaultPTZTimeout></{tag}>"
    )


def _node(camera: Camera, tag: str) -> str:
    listed = "".join(space.xml() for space in spaces(camera.spec))
    return (
        f'<{tag} token="{NODE}" FixedHomePosition="true"><tt:Name>head</tt:Name>'
        f"<tt:SupportedPTZSpaces>{listed}</tt:SupportedPTZSpaces>"
        "<tt:MaximumNumberOfPresets>0</tt:MaximumNumberOfPresets>"
        f"<tt:HomeSupported>false</tt:HomeSupported></{tag}>"
    )


def _nodes(camera: Camera, _asked: Element, _base: str) -> str:
    return _node(camera, "tptz:PTZNode")


def _one_node(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("NodeToken"), NODE, what="node")
    return _node(camera, "tptz:PTZNode")


def _configurations(camera: Camera, _asked: Element, _base: str) -> str:
    return configuration(camera, "tptz:PTZConfiguration")


def _one_configuration(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("PTZConfigurationToken"), CONFIGURATION, what="configuration")
    return configuration(camera, "tptz:PTZConfiguration")


def _status(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    spec, (pan, tilt, zoom) = camera.spec, camera.ptz
    if spec.degrees:
        x, y, uri = math.degrees(pan), math.degrees(tilt), DEGREES
    else:
        x, y, uri = share(spec, pan, "pan"), share(spec, tilt, "tilt"), GENERIC
    gimbal = camera.gimbal
    turning = "MOVING" if gimbal.pan.moving or gimbal.tilt.moving else "IDLE"
    zooming = "MOVING" if gimbal.zoom.moving else "IDLE"
    position = (
        f'<tt:Position><tt:PanTilt x="{x:.4f}" y="{y:.4f}" space="{uri}"/>'
        f'<tt:Zoom x="{share(spec, zoom, "zoom"):.5f}" space="{ZOOM}"/></tt:Position>'
    )
    now = datetime.fromtimestamp(camera.now_s, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return (
        f"<tptz:PTZStatus>{position if spec.positions else ''}"
        f"<tt:MoveStatus><tt:PanTilt>{turning}</tt:PanTilt><tt:Zoom>{zooming}</tt:Zoom>"
        f"</tt:MoveStatus><tt:UtcTime>{now}</tt:UtcTime></tptz:PTZStatus>"
    )


def _number(element: Element, name: str) -> float:
    try:
        value = float(element.attribute(name))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FaultError(f"{name} is no number", "InvalidArgVal")
    return value


def _see_that_it_moves(camera: Camera) -> None:
    if camera.fault_state.fault:
        raise FaultError(camera.fault_state.fault, "Action", "MovingPTZ", receiver=True)


def _absolute(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    _see_that_it_moves(camera)
    spec, gimbal = camera.spec, camera.gimbal
    place, zoom = asked.child("Position", "PanTilt"), asked.child("Position", "Zoom")
    speed = asked.child("Speed", "PanTilt")
    rate = None
    if speed is not None:
        uri = speed.attribute("space") or SPEED
        rate = max(meaning(spec, uri, abs(_number(speed, axis)), "pan") for axis in ("x", "y"))
    camera.advance()
    if place is not None:
        if not spec.turns:
            raise FaultError("no absolute moves", "ActionNotSupported", receiver=True)
        uri = place.attribute("space") or (DEGREES if spec.degrees else GENERIC)
        pan = meaning(spec, uri, _number(place, "x"), "pan")
        tilt = meaning(spec, uri, _number(place, "y"), "tilt")
        gimbal.pan.go(pan, rate)
        gimbal.tilt.go(tilt, rate)
        camera.moves += 1
    if zoom is not None:
        uri = zoom.attribute("space") or ZOOM
        gimbal.zoom.go(meaning(spec, uri, _number(zoom, "x"), "zoom"))
    return ""


def _continuous(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    _see_that_it_moves(camera)
    spec, gimbal = camera.spec, camera.gimbal
    if not spec.drives:
        raise FaultError("no velocities", "ActionNotSupported", receiver=True)
    said = asked.says("Timeout")
    seconds = isodate.parse_duration(said).total_seconds() if said else DEFAULT_TIMEOUT_S
    camera.advance()
    until_s = camera.monotonic() + seconds
    turn, zoom = asked.child("Velocity", "PanTilt"), asked.child("Velocity", "Zoom")
    if turn is not None:
        uri = turn.attribute("space") or VELOCITY
        pan = meaning(spec, uri, _number(turn, "x"), "pan")
        tilt = meaning(spec, uri, _number(turn, "y"), "tilt")
        gimbal.pan.run(pan, until_s)
        gimbal.tilt.run(tilt, until_s)
        camera.moves += 1
    if zoom is not None:
        uri = zoom.attribute("space") or ZOOM_VELOCITY
        gimbal.zoom.run(meaning(spec, uri, _number(zoom, "x"), "zoom"), until_s)
    return ""


def _stop(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    camera.advance()
    if asked.says("PanTilt") not in ("false", "0"):
        camera.gimbal.pan.stop()
        camera.gimbal.tilt.stop()
    if asked.says("Zoom") not in ("false", "0"):
        camera.gimbal.zoom.stop()
    return ""


OPERATIONS: Operations = {
    "GetNodes": _nodes,
    "GetNode": _one_node,
    "GetConfigurations": _configurations,
    "GetConfiguration": _one_configuration,
    "GetStatus": _status,
    "AbsoluteMove": _absolute,
    "ContinuousMove": _continuous,
    "Stop": _stop,
}
