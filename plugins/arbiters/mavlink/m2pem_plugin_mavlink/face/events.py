"""Records, alerts and holders as what vehicles show and say."""

import asyncio
import re
from collections.abc import Callable, Collection, Mapping
from functools import partial

from m2pem.api import (
    Alert,
    BehaviorState,
    Importance,
    Listener,
    MissionControl,
    ResourceId,
    RunId,
    RunView,
    StampedRecord,
    describe,
    shown_geometries,
)
from m2pem.api.records import (
    BehaviorEnded,
    BehaviorProgressed,
    BehaviorRequested,
    BehaviorUnsettled,
)
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.face.orders import Orders
from m2pem_plugin_mavlink.face.plan import plan_of
from m2pem_plugin_mavlink.face.plan_runs import PlanRuns
from m2pem_plugin_mavlink.face.texts import TextSeverity
from m2pem_plugin_mavlink.face.vehicle import ShownVehicle

HOLDERS_EVERY_S = 1.0

_OF_A_RUN = re.compile(r"r\d+\.\w+")
"""Holders that are behaviors, requests or incidents, not operators."""

_REPORTED = (BehaviorRequested, BehaviorEnded, BehaviorUnsettled)

Say = Callable[[ShownVehicle, TextSeverity, str], None]
"""Sends a text of a vehicle to all stations."""


class Events(Listener):
    """`vehicles`: those that are shown, by name."""

    def __init__(
        self,
        vehicles: Mapping[ResourceId, ShownVehicle],
        control: MissionControl,
        orders: Orders,
        plans: PlanRuns,
        say: Say,
    ) -> None:
        self._plans = plans
        self._vehicles = vehicles
        self._control = control
        self._orders = orders
        self._say = say
        self._words = {
            name: re.compile(rf"(?<![\w-]){re.escape(name)}(?![\w-])") for name in vehicles
        }

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        """See `Listener`."""
        record = stamped.record
        concerned: Collection[ShownVehicle] = ()
        match record:
            case BehaviorRequested():
                concerned = self._of(record.resources)
                for vehicle in concerned:
                    if vehicle.resource in record.resources:
                        vehicle.behavior, vehicle.behavior_id = record.name, record.behavior
                        self._plans.requested(vehicle, stamped.run, record.element)
                        find = partial(self._geometry, stamped.run)
                        # Before its run is taken up, its geometries are not known.
                        items = plan_of(record.name, record.parameters, find) or list(
                            self._plans.way_of(vehicle, stamped.run)
                        )
                        vehicle.plan.replace(items, is_under_way=not is_new)
            case BehaviorProgressed() if is_new:
                self._orders.progressed(stamped.run, record.state)
            case BehaviorUnsettled():
                concerned = self._of(self._resources(view, record.behavior))
            case BehaviorEnded():
                concerned = self._of(self._resources(view, record.behavior))
                for vehicle in concerned:
                    if vehicle.behavior_id == record.behavior:
                        vehicle.behavior = vehicle.behavior_id = ""
                        vehicle.plan.replace(())
                    if record.state is BehaviorState.SUCCEEDED:
                        known = view.behavior(record.behavior)
                        element = known.element if known is not None else ""
                        self._plans.task_ended(vehicle, stamped.run, element, is_new=is_new)
                if is_new:
                    reason = record.reason or record.code or record.state.value.lower()
                    self._orders.ended(stamped.run, record.state, reason)
        if is_new and concerned and isinstance(record, _REPORTED):
            sentence = describe(stamped, view)
            severity = TextSeverity.INFO
            failed = isinstance(record, BehaviorEnded) and record.state in (
                BehaviorState.FAILED,
                BehaviorState.REJECTED,
                BehaviorState.LOST,
            )
            if failed or sentence.importance is Importance.ERROR:
                severity = TextSeverity.ERROR
            elif sentence.importance is Importance.WARNING:
                severity = TextSeverity.WARNING
            for vehicle in concerned:
                self._say(vehicle, severity, f"{stamped.run} {sentence.text}")

    def run_added(self, view: RunView) -> None:
        """See `Listener`."""
        self.status_changed(view)

    def status_changed(self, view: RunView) -> None:
        """See `Listener`."""
        self._plans.status_changed(self._vehicles.values(), view.run, view.status)

    def _geometry(self, run: RunId, name: str) -> object:
        """Return what a task of a run gets by the name of a geometry; None: there is none."""
        own = self._control.run_geometries().get(run, {})
        return own.get(name) or shown_geometries(self._control).get(name)

    def alerted(self, alert: Alert) -> None:
        """See `Listener`. An alert is for the vehicles that it names."""
        for name, vehicle in self._vehicles.items():
            if self._words[name].search(alert.text):
                self._say(vehicle, TextSeverity.WARNING, alert.text)

    async def follow_holders(self, control: MissionControl) -> None:
        """Keep who has taken each vehicle, until cancelled."""
        while True:
            try:
                holders = await control.holders()
            except M2pemError:
                holders = {}
            for name, vehicle in self._vehicles.items():
                holder = holders.get(name, "")
                vehicle.operator = "" if _OF_A_RUN.fullmatch(holder) else holder
            await asyncio.sleep(HOLDERS_EVERY_S)

    @staticmethod
    def _resources(view: RunView, behavior: str) -> Collection[str]:
        found = view.behavior(behavior)
        return found.resources if found is not None else ()

    def _of(self, resources: Collection[str]) -> list[ShownVehicle]:
        """Return the vehicles among resources, and those that carry the payloads among them."""
        names = dict.fromkeys(ResourceId(each.partition("/")[0]) for each in resources)
        return [self._vehicles[name] for name in names if name in self._vehicles]
