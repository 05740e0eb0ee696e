"""The PTZ service: where the camera looks, and how it is turned."""

import math
from datetime import UTC, datetime

import isodate

from m2pem_plugin_ptz.sim.onvif.camera import Camera
from m2pem_plugin_ptz.sim.onvif.services.coordinates import (
    DEGREES,
    GENERIC,
    SPEED,
    VELOCITY,
    ZOOM,
    ZOOM_VELOCITY,
    meaning,
    share,
    spaces,
)
from m2pem_plugin_ptz.sim.onvif.services.service import (
    CONFIGURATION,
    NODE,
    PROFILE,
    Operations,
    know,
)
from m2pem_plugin_ptz.sim.onvif.soap import Element, FaultError

DEFAULT_TIMEOUT_S = 10.0


def configuration(camera: Camera, tag: str) -> str:
    """The PTZ configuration of the profile."""
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
    return f"<tptz:GetNodesResponse>{_node(camera, 'tptz:PTZNode')}</tptz:GetNodesResponse>"


def _one_node(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("NodeToken"), NODE, what="node")
    return f"<tptz:GetNodeResponse>{_node(camera, 'tptz:PTZNode')}</tptz:GetNodeResponse>"


def _configurations(camera: Camera, _asked: Element, _base: str) -> str:
    inner = configuration(camera, "tptz:PTZConfiguration")
    return f"<tptz:GetConfigurationsResponse>{inner}</tptz:GetConfigurationsResponse>"


def _one_configuration(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("PTZConfigurationToken"), CONFIGURATION, what="configuration")
    inner = configuration(camera, "tptz:PTZConfiguration")
    return f"<tptz:GetConfigurationResponse>{inner}</tptz:GetConfigurationResponse>"


def _status(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    spec, (pan, tilt, zoom) = camera.spec, camera.look
    if spec.degrees:
        x, y, uri = math.degrees(pan), math.degrees(tilt), DEGREES
    else:
        x, y, uri = share(spec, pan, "pan"), share(spec, tilt, "tilt"), GENERIC
    head = camera.head
    turning = "MOVING" if head.pan.moving or head.tilt.moving else "IDLE"
    zooming = "MOVING" if head.zoom.moving else "IDLE"
    position = (
        f'<tt:Position><tt:PanTilt x="{x:.4f}" y="{y:.4f}" space="{uri}"/>'
        f'<tt:Zoom x="{share(spec, zoom, "zoom"):.5f}" space="{ZOOM}"/></tt:Position>'
    )
    now = datetime.fromtimestamp(camera.now_s, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return (
        f"<tptz:GetStatusResponse><tptz:PTZStatus>{position if spec.positions else ''}"
        f"<tt:MoveStatus><tt:PanTilt>{turning}</tt:PanTilt><tt:Zoom>{zooming}</tt:Zoom>"
        f"</tt:MoveStatus><tt:UtcTime>{now}</tt:UtcTime></tptz:PTZStatus></tptz:GetStatusResponse>"
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
    if camera.troubles.fault:
        raise FaultError(camera.troubles.fault, "Action", "MovingPTZ", receiver=True)


def _absolute(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    _see_that_it_moves(camera)
    spec, head = camera.spec, camera.head
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
        head.pan.go(pan, rate)
        head.tilt.go(tilt, rate)
        camera.moves += 1
    if zoom is not None:
        uri = zoom.attribute("space") or ZOOM
        head.zoom.go(meaning(spec, uri, _number(zoom, "x"), "zoom"))
    return "<tptz:AbsoluteMoveResponse/>"


def _continuous(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    _see_that_it_moves(camera)
    spec, head = camera.spec, camera.head
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
        head.pan.run(pan, until_s)
        head.tilt.run(tilt, until_s)
        camera.moves += 1
    if zoom is not None:
        uri = zoom.attribute("space") or ZOOM_VELOCITY
        head.zoom.run(meaning(spec, uri, _number(zoom, "x"), "zoom"), until_s)
    return "<tptz:ContinuousMoveResponse/>"


def _stop(camera: Camera, asked: Element, _base: str) -> str:
    know(asked.says("ProfileToken"), PROFILE)
    camera.advance()
    if asked.says("PanTilt") not in ("false", "0"):
        camera.head.pan.stop()
        camera.head.tilt.stop()
    if asked.says("Zoom") not in ("false", "0"):
        camera.head.zoom.stop()
    return "<tptz:StopResponse/>"


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
