"""/api/estimates: what a mission takes as it is drawn, of each vehicle."""

import math

from fastapi import APIRouter

from m2pem.api import MissionControl, NotEstimated, TaskEstimate
from m2pem_plugin_web.access.permissions import Viewer
from m2pem_plugin_web.missions.folder import MissionFolder
from m2pem_plugin_web.problems import RESPONSES
from m2pem_plugin_web.rest.bounded_threads import BoundedThreads
from m2pem_plugin_web.rest.drafts import DraftModel, draft_of
from m2pem_plugin_web.rest.models import Answer


class VehicleEstimateModel(Answer):
    """A vehicle. `battery_left`: at the mission's end; `stated`: whether the fleet file says its
    endurance, or the simulation assumes it."""

    vehicle: str
    distance_m: float
    time_s: float
    battery_left: float
    endurance_s: float | None
    stated: bool


class MissionEstimateModel(Answer):
    """A mission. `reserve`: the part of a full battery that plans leave unused."""

    time_s: float
    reserve: float
    vehicles: list[VehicleEstimateModel]
    tasks: list[TaskEstimate]
    left_out: list[NotEstimated]


def router(control: MissionControl, folder: MissionFolder) -> APIRouter:
    """The route of estimates."""
    routes = APIRouter(prefix="/api", tags=["checks"], responses=RESPONSES)
    threads = BoundedThreads()

    @routes.post("/estimates")
    async def estimate(_: Viewer, wanted: DraftModel) -> MissionEstimateModel:
        """Distance, time and battery of each vehicle, and what could not be estimated."""
        draft = await draft_of(wanted, folder)
        found = await threads.run(control.estimate, draft, process=wanted.process)
        vehicles = [
            VehicleEstimateModel.of(
                each, endurance_s=None if math.isinf(each.endurance_s) else each.endurance_s
            )
            for each in found.vehicles
        ]
        return MissionEstimateModel.of(found, vehicles=vehicles)

    return routes
