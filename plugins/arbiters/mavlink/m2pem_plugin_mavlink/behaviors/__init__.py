"""The behaviors of the catalogue, one class each, in terms of a vehicle and its driver."""

from collections.abc import Callable, Mapping

from m2pem_plugin_mavlink.behaviors.area_observe import ObserveFromAbove, ObserveFromTheEdge
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, BehaviorContext
from m2pem_plugin_mavlink.behaviors.deploy import Deploy
from m2pem_plugin_mavlink.behaviors.follow import Follow
from m2pem_plugin_mavlink.behaviors.goto import DriveStop, Goto, Hold, Teleop
from m2pem_plugin_mavlink.behaviors.mission import Routing, RunOnboardMission, Survey
from m2pem_plugin_mavlink.behaviors.orbit import Orbit
from m2pem_plugin_mavlink.behaviors.reverse import Reverse
from m2pem_plugin_mavlink.behaviors.takeoff_landing import (
    ChangeAltitude,
    Land,
    ReturnToLaunch,
    SetSpeed,
    Takeoff,
)


def _observe(context: BehaviorContext) -> Behavior:
    return (
        ObserveFromAbove(context)
        if context.vehicle.domain == "air"
        else ObserveFromTheEdge(context)
    )


BEHAVIORS: Mapping[str, Callable[[BehaviorContext], Behavior]] = {
    "single_vehicle_routing": Routing,
    "goto": Goto,
    "hold": Hold,
    "drive_stop": DriveStop,
    "land": Land,
    "return_to_launch": ReturnToLaunch,
    "reverse": Reverse,
    "takeoff": Takeoff,
    "change_altitude": ChangeAltitude,
    "area_survey": Survey,
    "orbit": Orbit,
    "area_observe": _observe,
    "follow": Follow,
    "teleop": Teleop,
    "set_speed": SetSpeed,
    "deploy": Deploy,
    "run_onboard_mission": RunOnboardMission,
}
"""By name, as in the catalogue."""
