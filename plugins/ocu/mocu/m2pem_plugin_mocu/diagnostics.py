"""What /diagnostics says of the executive, its journal and its vehicles (diagnostic_msgs)."""

import asyncio
import logging
import math
import time
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from m2pem_plugin_ros import OWN_STATUS, RosRuntime, messages, one_line

from m2pem.api import (
    Fleet,
    Follower,
    LinkState,
    MissionControl,
    PayloadState,
    ResourceId,
    RunId,
    TeamState,
    VehicleState,
)
from m2pem.errors import M2pemError
from m2pem_plugin_mocu.services import Services
from m2pem_plugin_mocu.settings import DEFAULT_NAMESPACE
from m2pem_plugin_mocu.topics import Topics

LOW_BATTERY = 0.2
LATE_S = 1.0
"""When the executive's event loop comes so much too late, operators notice."""

EVERY_S = 1.0
JOURNAL_WITHIN_S = 5.0
BEYOND_ALL = 2**60
"""A place in a journal where nothing is: to read from there shows that it can be read."""

log = logging.getLogger("m2pem.ocu.mocu")


@dataclass(frozen=True, slots=True)
class Health:
    """State of the executive, as this unit measures it.

    `listeners`: how many operators' clients receive all events. `servers`: how many nodes offer our
    services. `journal_s`: how long it took to read from the journal; `journal_error`: why it could
    not be.
    """

    name: str
    late_s: float
    servers: int
    runs: int
    prompts: int
    listeners: int
    refused: int
    left_out: int
    journal_s: float
    journal_error: str = ""


class Vehicles:
    """The latest state of each vehicle and payload. `site`: see `site_of`."""

    def __init__(self, fleet: Fleet, site: str = "") -> None:
        self._fleet = fleet
        self.site = site
        self._last: dict[ResourceId, VehicleState | PayloadState] = {}

    def receive(self, state: VehicleState | PayloadState) -> None:
        """Keep a state."""
        self._last[state.resource] = state

    def statuses(self) -> list[Any]:
        """One for each vehicle, and for each payload that has sent a state."""
        mounted = [each for each in self._fleet.payloads if each in self._last]
        return [self._status(resource) for resource in [*self._fleet.vehicles, *mounted]]

    def _status(self, resource: ResourceId) -> Any:
        hardware = f"{self.site}{resource}"
        name = f"link {hardware}"
        if resource not in self._last:
            return _status(name, hardware, DiagnosticStatus.STALE, "nothing received yet", {})
        state = self._last[resource]
        values = {"link": state.link.value, "behavior": state.behavior}
        problems: list[str] = []
        if isinstance(state, VehicleState):
            values |= _of_vehicle(state)
            problems = _problems(state)
        else:
            values |= _of_payload(state)
        level = DiagnosticStatus.WARN if problems else DiagnosticStatus.OK
        if state.link is LinkState.DEGRADED:
            level, problems = DiagnosticStatus.WARN, ["link degraded", *problems]
        if state.link is LinkState.LOST:
            level, problems = DiagnosticStatus.ERROR, ["link lost", *problems]
        return _status(name, hardware, level, "; ".join(problems) or "received", values)


def site_of(namespace: str) -> str:
    """Return what tells names in /diagnostics from those of an executive in another namespace:
    "team_a/m2pem/", or "" in the default one."""
    return "" if namespace == DEFAULT_NAMESPACE else f"{namespace.strip('/')}/"


def _of_vehicle(state: VehicleState) -> dict[str, str]:
    said: dict[str, object] = {"mode": state.mode, "armed": state.armed, "ready": state.ready}
    if state.battery_fraction is not None:
        said["battery"] = f"{state.battery_fraction:.2f}"
    if state.position is not None:
        said["latitude_deg"] = f"{state.position.latitude_deg:.7f}"
        said["longitude_deg"] = f"{state.position.longitude_deg:.7f}"
        said["altitude_m"] = f"{state.position.altitude_m:.1f}"
    return {key: str(value) for key, value in said.items() if value is not None and value != ""}


def _of_payload(state: PayloadState) -> dict[str, str]:
    said = {"pan_deg": state.pan_rad, "tilt_deg": state.tilt_rad}
    values = {key: f"{math.degrees(angle):.1f}" for key, angle in said.items() if angle is not None}
    if state.zoom is not None:
        values["zoom"] = f"{state.zoom:.2f}"
    return values


def _problems(state: VehicleState) -> list[str]:
    problems: list[str] = []
    if state.battery_fraction is not None and state.battery_fraction < LOW_BATTERY:
        problems.append(f"battery at {state.battery_fraction:.0%}")
    if state.ready is False:
        problems.append(f"not ready: {', '.join(state.not_ready_reasons) or 'it does not say why'}")
    return problems


def _executive(health: Health, site: str) -> Any:
    level, problems = DiagnosticStatus.OK, list[str]()
    if health.late_s > LATE_S or health.left_out:
        level = DiagnosticStatus.WARN
    if health.late_s > LATE_S:
        problems.append(f"busy: {health.late_s:.1f} s late")
    if health.left_out:
        problems.append(f"{health.left_out} events were left out, as there were too many")
    if health.servers > 1:
        level = DiagnosticStatus.ERROR
        problems.append(
            f"{health.servers} executives serve this namespace: each does what is asked"
        )
    values = {
        "runs": health.runs,
        "prompts": health.prompts,
        "listeners": health.listeners,
        "requests refused": health.refused,
        "events left out": health.left_out,
        "late_s": f"{health.late_s:.3f}",
    }
    return _status(f"{site}executive", health.name, level, "; ".join(problems) or "serves", values)


def _journal(health: Health, site: str) -> Any:
    if health.journal_error:
        level, text = DiagnosticStatus.ERROR, health.journal_error
    else:
        level, text = DiagnosticStatus.OK, "readable"
    values = {"read_s": f"{health.journal_s:.3f}"}
    return _status(f"{site}journal", health.name, level, text, values)


def diagnostics(health: Health, vehicles: Vehicles, now_us: int) -> Any:
    """All of it, as one message."""
    site = vehicles.site
    statuses = [_executive(health, site), _journal(health, site), *vehicles.statuses()]
    message = DiagnosticArray(status=statuses)
    message.header.stamp = messages.time_of(now_us)
    return message


def _status(name: str, hardware: str, level: bytes, text: str, values: dict[str, Any]) -> Any:
    return DiagnosticStatus(
        name=f"{OWN_STATUS}{name}",
        hardware_id=one_line(hardware),
        level=level,
        message=one_line(text),
        values=[KeyValue(key=key, value=one_line(str(value))) for key, value in values.items()],
    )


class DiagnosticsPublisher:
    """Publishes /diagnostics once a second. `run` and `listen` go on until cancelled."""

    def __init__(
        self,
        ros: RosRuntime,
        control: MissionControl,
        follower: Follower,
        topics: Topics,
        services: Services,
    ) -> None:
        self._node = ros.node
        self._control = control
        self._follower = follower
        self._latest_run: RunId | None = None
        self._topics = topics
        self._services = services
        self._vehicles = Vehicles(control.fleet(), site_of(ros.node.get_namespace()))
        self._publisher = ros.node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._warned = False

    async def listen(self) -> None:
        """Receive telemetry."""
        async for state in self._control.telemetry():
            if not isinstance(state, TeamState):
                self._vehicles.receive(state)

    async def run(self) -> None:
        """Measure and publish."""
        late_s = 0.0
        while True:
            try:
                health = await self._measure(late_s)
                self._publisher.publish(diagnostics(health, self._vehicles, self._topics.now_us()))
            except Exception:  # what cannot be measured now may be the next time
                log.exception("/diagnostics cannot be published")
            began_s = time.monotonic()
            await asyncio.sleep(EVERY_S)
            late_s = time.monotonic() - began_s - EVERY_S

    async def _measure(self, late_s: float) -> Health:
        servers = self._node.count_services(f"{self._node.get_namespace()}/start_mission")
        if servers > 1 and not self._warned:
            self._warned = True
            log.warning(
                "%d executives serve %s in this ROS domain, and each does what operators ask: "
                "give one another namespace (M2PEM_ROS_NAMESPACE) or domain (ROS_DOMAIN_ID)",
                servers,
                self._node.get_namespace(),
            )
        began_s = time.monotonic()
        error = await self._journal_error()
        return Health(
            name=self._control.fleet().name,
            late_s=max(0.0, late_s),
            servers=servers,
            runs=sum(not each.status.ended for each in self._follower.views.values()),
            prompts=len(self._follower.prompts),
            listeners=self._topics.listeners(),
            refused=sum(limit.refused for limit in self._services.limits.values()),
            left_out=self._topics.left_out,
            journal_s=time.monotonic() - began_s,
            journal_error=error,
        )

    async def _journal_error(self) -> str:
        try:
            async with asyncio.timeout(JOURNAL_WITHIN_S):
                if (run := next(iter(self._follower.views), self._latest_run)) is None:
                    self._latest_run = next(
                        (each.run for each in reversed(await self._control.runs())), None
                    )
                else:
                    await self._control.records(run, BEYOND_ALL, 1)
        except TimeoutError:
            return f"it does not answer within {JOURNAL_WITHIN_S:g} s"
        except M2pemError as error:
            return str(error)
        return ""
