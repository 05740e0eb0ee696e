"""The checks of `m2pem doctor` for ROS 2: its installation, interfaces of a fleet, the domain."""

import asyncio
import os
from collections.abc import Iterator, Sequence

from m2pem.api import Fleet, HealthCheck, HealthStatus
from m2pem.errors import M2pemError
from m2pem_plugin_ros.installation import RosError, installed_as, require_interfaces, require_ros
from m2pem_plugin_ros.settings import HIGHEST_DOMAIN, DriverName, OdomFrame

OK, WARNING, ERROR = HealthStatus.OK, HealthStatus.WARNING, HealthStatus.ERROR

PACKAGES = {DriverName.NODE: "m2pem_interfaces", DriverName.NAV2: "nav2_msgs"}
"""The packages of interfaces that the drivers of vehicles need."""


def check_host(fleet: Fleet | None) -> Sequence[HealthCheck]:
    """Check ROS: of a fleet with ROS vehicles what they need, else whether there is one ROS."""
    connections = [
        vehicle.settings
        for vehicle in (fleet.vehicles.values() if fleet is not None else ())
        if vehicle.arbiter == "ros"
    ]
    drivers = {str(each.get("driver", DriverName.NODE)) for each in connections}
    if fleet is not None and not drivers:
        return ()
    found = installed_as()
    if not drivers and not found:
        return [HealthCheck("ros", OK, "ROS 2 is not here: fleets without ROS do not need it")]
    try:
        require_ros()
        for driver in sorted(drivers & set(PACKAGES)):
            require_interfaces(PACKAGES[DriverName(driver)])
        if any(each.get("odom_frame") == OdomFrame.TF for each in connections):
            require_interfaces("tf2_msgs")
    except RosError as error:
        what, _, remedy = str(error).partition("; ")
        return [HealthCheck("ros", ERROR, what, remedy or "see docs/ros.md, Install")]
    here = HealthCheck("ros", OK, f"ROS 2 is {found or 'installed for this Python'}")
    checks = [here, *_domain()]
    if fleet is not None and all(check.status is OK for check in checks):
        checks += _vehicles(fleet)
    return checks


def _vehicles(fleet: Fleet) -> Sequence[HealthCheck]:
    from m2pem_plugin_ros.fleet_check import check_vehicles  # noqa: PLC0415  # it needs rclpy

    try:
        return asyncio.run(check_vehicles(fleet))
    except M2pemError as error:
        return [HealthCheck("ros vehicles", ERROR, str(error))]


def _domain() -> Iterator[HealthCheck]:
    text = os.environ.get("ROS_DOMAIN_ID", "").strip()
    if not text:
        yield HealthCheck("ros domain", OK, "0, as ROS_DOMAIN_ID is not set")
    elif text.isascii() and text.isdigit() and int(text) <= HIGHEST_DOMAIN:
        yield HealthCheck("ros domain", OK, f"{text}, by ROS_DOMAIN_ID")
    else:
        remedy = f"export ROS_DOMAIN_ID=N, with a number from 0 to {HIGHEST_DOMAIN}"
        yield HealthCheck("ros domain", ERROR, f"ROS_DOMAIN_ID={text} is not a domain", remedy)
