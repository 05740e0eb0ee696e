"""The behaviors of the catalogue, in terms of a vehicle and its driver: one class each."""

from collections.abc import Callable, Mapping

from m2pem_plugin_mavlink.behaviors.backing import Reverse
from m2pem_plugin_mavlink.behaviors.behavior import Behavior, Job
from m2pem_plugin_mavlink.behaviors.deploy import Deploy
from m2pem_plugin_mavlink.behaviors.flight import (
    ChangeAltitude,
    Land,
    ReturnToLaunch,
    SetSpeed,
    Takeoff,
)
from m2pem_plugin_mavlink.behaviors.following import Follow
from m2pem_plugin_mavlink.behaviors.going import DriveStop, Goto, Hold
from m2pem_plugin_mavlink.behaviors.observe import ObserveFromAbove, ObserveFromTheEdge
from m2pem_plugin_mavlink.behaviors.onboard import RunOnboardMission
from m2pem_plugin_mavlink.behaviors.orbit import Orbit
from m2pem_plugin_mavlink.behaviors.routing import Routing
from m2pem_plugin_mavlink.behaviors.survey import Survey


def _observe(job: Job) -> Behavior:
    return ObserveFromAbove(job) if job.vehicle.domain == "air" else ObserveFromTheEdge(job)


BEHAVIORS: Mapping[str, Callable[[Job], Behavior]] = {
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
    "set_speed": SetSpeed,
    "deploy": Deploy,
    "run_onboard_mission": RunOnboardMission,
}
"""By name, as in the catalogue."""
