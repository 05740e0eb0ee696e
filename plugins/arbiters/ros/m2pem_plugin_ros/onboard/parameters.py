"""The ROS parameters of `m2pem ros onboard`: the settings of the connection, which are read-only.

The values of the command line are the defaults; `-p` and `--params-file` override them.
"""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.node import Node

from m2pem.api import did_you_mean
from m2pem.api.command_options import read_position
from m2pem_plugin_ros.installation import RosError
from m2pem_plugin_ros.settings import (
    BOUNDS,
    DOMAINS,
    DriverName,
    FixAltitude,
    OdomFrame,
    RouteAction,
    Settings,
    Topics,
)

MOST = 1000.0
"""Upper end of the ranges of limits, in SI units: for sliders of tools."""

SIM_TIME = "use_sim_time"
OF_ROS = (SIM_TIME, "start_type_description_service")
OF_QOS = "qos_overrides."

UNITS = {
    "speed": "m/s",
    "reverse_speed": "m/s",
    "acceleration": "m/s2",
    "yaw_rate": "rad/s",
    "turn_radius": "m",
    "lateral_acceleration": "m/s2",
}

logger = logging.getLogger("m2pem.onboard")


@dataclass(frozen=True, slots=True)
class _Parameter:
    name: str
    default: Any
    doc: str
    choices: tuple[str, ...] = ()


def declare_parameters(
    node: Node, settings: Settings, domain: str, origin: tuple[float, float, float]
) -> tuple[dict[str, Any], str, tuple[float, float, float]]:
    """Declare the parameters with their defaults; return the values that differ from these as keys
    of a connection, the domain of the vehicle, and the origin.

    The node must have declared its overrides. A name that is none of ours is logged.

    Raises:
        RosError: a value has the wrong type or is out of range.
    """
    known = list(_parameters(settings, domain, origin))
    _report_others(node, [parameter.name for parameter in known])
    values = {parameter.name: _declare(node, parameter) for parameter in known}
    node.add_on_set_parameters_callback(_refuse_changes)
    given: dict[str, Any] = {}
    for parameter in known:
        value = values[parameter.name]
        if value == parameter.default or parameter.name in ("domain", "origin"):
            continue
        outer, dot, inner = parameter.name.partition(".")
        if dot:
            said = f"{value} {UNITS[inner]}" if outer == "bounds" else value
            given.setdefault(outer, {})[inner] = said
        else:
            given[outer] = value
    return given, str(values["domain"]), _origin(values["origin"])


def _parameters(
    settings: Settings, domain: str, origin: tuple[float, float, float]
) -> Iterator[_Parameter]:
    yield _Parameter(
        "origin",
        list(origin),
        "Origin of the frame map: latitude and longitude in degrees, altitude in m above "
        "mean sea level. That of the fleet.",
    )
    yield _Parameter("domain", domain, "Domain of the vehicle.", DOMAINS)
    drivers = (DriverName.BASE.value, DriverName.NAV2.value)
    yield _Parameter(
        "driver", settings.driver.value, "What drives: velocities from m2pem, or Nav2.", drivers
    )
    yield _Parameter(
        "base_frame", settings.base_frame, "Frame of the vehicle; empty: that of its odometry."
    )
    for name, kind, doc in (
        ("odom_frame", OdomFrame, "Frame of the odometry (REP-105)."),
        ("fix_altitude", FixAltitude, "What the altitude of satellite fixes counts from."),
        ("route_action", RouteAction, "Action of Nav2 for routes."),
    ):
        choices = tuple(str(each) for each in kind)
        yield _Parameter(name, str(getattr(settings, name)), doc, choices)
    yield _Parameter("stamped", settings.stamped, "Whether cmd_vel is a TwistStamped.")
    yield _Parameter("hardware_id", settings.hardware_id, "The vehicle in /diagnostics.")
    for each in fields(Topics):
        said = f"Topic for {each.name}; in the namespace unless it begins with '/'."
        yield _Parameter(f"topics.{each.name}", getattr(settings.topics, each.name), said)
    for key, field in BOUNDS.items():
        said = f"Limit of a plain base: {key.replace('_', ' ')} in {UNITS[key]}."
        yield _Parameter(f"bounds.{key}", float(getattr(settings.bounds, field)), said)


def _declare(node: Node, parameter: _Parameter) -> Any:
    descriptor = ParameterDescriptor(
        name=parameter.name, description=parameter.doc, read_only=True, type=_type(parameter)
    )
    if parameter.choices:
        descriptor.additional_constraints = f"One of: {', '.join(parameter.choices)}"
    if isinstance(parameter.default, float):
        descriptor.floating_point_range = [FloatingPointRange(from_value=0.0, to_value=MOST)]
    if node.has_parameter(parameter.name):  # declared without a descriptor, by its override
        node.undeclare_parameter(parameter.name)
    try:
        value = node.declare_parameter(parameter.name, parameter.default, descriptor).value
    except Exception as error:  # rclpy has no base class for what it raises
        raise RosError(f"{node.get_fully_qualified_name()}: parameter {error}") from error
    if parameter.choices and value not in parameter.choices:
        raise RosError(
            f"{node.get_fully_qualified_name()}: parameter {parameter.name}: {value!r} is not one "
            f"of {', '.join(parameter.choices)}"
        )
    return list(value) if isinstance(parameter.default, list) else value


def _type(parameter: _Parameter) -> int:
    match parameter.default:
        case bool():
            kind = ParameterType.PARAMETER_BOOL
        case float():
            kind = ParameterType.PARAMETER_DOUBLE
        case list():
            kind = ParameterType.PARAMETER_DOUBLE_ARRAY
        case _:
            kind = ParameterType.PARAMETER_STRING
    return int(kind)


def _origin(values: list[float]) -> tuple[float, float, float]:
    text = ",".join(f"{value!r}" for value in values)
    try:
        place = read_position(text)
    except ValueError as error:
        raise RosError(f"parameter origin: {values} is no LAT,LON,ALT: {error}") from error
    return place.latitude_deg, place.longitude_deg, place.altitude_m


def _report_others(node: Node, known: list[str]) -> None:
    """Log parameters that this node does not have, which ROS would ignore silently."""
    for name in sorted(node.get_parameters_by_prefix("")):
        if name in known or name in OF_ROS or name.startswith(OF_QOS):
            continue
        hint = did_you_mean(name, known)
        logger.warning(
            "parameter %s is ignored: this node has none of that name%s",
            name,
            f"; {hint}" if hint else "",
        )
        node.undeclare_parameter(name)


def _refuse_changes(parameters: Any) -> SetParametersResult:
    """Refuse another clock for a running node. Read-only parameters are refused by rclpy."""
    if any(each.name == SIM_TIME for each in parameters):
        reason = f"start the node with -p {SIM_TIME}:=...: its clock cannot change while it runs"
        return SetParametersResult(successful=False, reason=reason)
    return SetParametersResult(successful=True)


def merged(given: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a connection with the overrides, also those of inner maps."""
    together = dict(given)
    for key, value in overrides.items():
        inner = together.get(key)
        together[key] = {**inner, **value} if isinstance(inner, dict) else value
    return together
