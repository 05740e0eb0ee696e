"""Says once a second on /diagnostics how the executive and its vehicles are."""

import asyncio
import logging
import time

from diagnostic_msgs.msg import DiagnosticArray
from m2pem_plugin_ros import RosRuntime

from m2pem.api import Follower, MissionControl, RunId, TeamState
from m2pem.errors import M2pemError
from m2pem_plugin_mocu.diagnostics import Health, Vehicles, diagnostics
from m2pem_plugin_mocu.services import Services
from m2pem_plugin_mocu.topics import Topics, now_us

EVERY_S = 1.0
JOURNAL_WITHIN_S = 5.0
BEYOND_ALL = 2**60
"""A place in a journal where nothing is: to read from there shows that it can be read."""

log = logging.getLogger("m2pem.ocu.mocu")


class Examiner:
    """`run` and `listen` go on until cancelled."""

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
        self._vehicles = Vehicles(control.fleet())
        self._publisher = ros.node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._warned = False

    async def listen(self) -> None:
        """Hear what vehicles say."""
        async for state in self._control.telemetry():
            if not isinstance(state, TeamState):
                self._vehicles.hear(state)

    async def run(self) -> None:
        """Examine, and say what was found."""
        late_s = 0.0
        while True:
            try:
                health = await self._examine(late_s)
                self._publisher.publish(diagnostics(health, self._vehicles, now_us()))
            except Exception:  # what cannot be examined now may be the next time
                log.exception("/diagnostics cannot be told")
            began_s = time.monotonic()
            await asyncio.sleep(EVERY_S)
            late_s = time.monotonic() - began_s - EVERY_S

    async def _examine(self, late_s: float) -> Health:
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
            refused=sum(gate.refused for gate in self._services.gates.values()),
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
