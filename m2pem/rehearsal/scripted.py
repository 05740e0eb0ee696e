"""Arbiters and services that follow an answers file: decorators of those that plugins offer."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from m2pem.api.arbiter import Arbiter, ArbiterContext, BehaviorRequest, Connection
from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.findings import Finding
from m2pem.fleet.fleet import SIMULATED, sim_settings
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value
from m2pem.plugins import Plugins
from m2pem.rehearsal.answers import Answers
from m2pem.rehearsal.answers_file import BehaviorEntry, ServiceEntry
from m2pem.simulation.arbiters import SimArbiter

if TYPE_CHECKING:
    from m2pem.engine.records import Record
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission

_SIMULATED = BehaviorEntry(end="simulated")
"""As without an entry."""

Unscripted = Callable[[str], ServiceEntry | None]
"""What a service of that class does where the answers say nothing; None: it is run."""


class ScriptedPlugins:
    """Offers what `plugins` offers, with arbiters and services that follow the answers.

    `simulated`: the simulated arbiters that were made so far. `ending`: how many scripted services
    are under way; they end by themselves.
    """

    def __init__(
        self, plugins: Plugins, answers: Answers, unscripted: Unscripted = lambda _: None
    ) -> None:
        self.simulated: list[SimArbiter] = []
        self.ending = 0
        self.holds_wait: Callable[[], bool] = lambda: False
        """Whether nothing is held now, as time does not advance: the run is paused to be debugged.
        A hold would change how its vehicles go on."""
        self.not_held: dict[ResourceId, Arbiter] = {}
        """Resources of holds that wait."""
        self._plugins = plugins
        self._answers = answers
        self._unscripted = unscripted

    def arbiter(self, name: str) -> Callable[..., Arbiter]:
        """The arbiter of that name, scripted; errors as for the plugins."""
        make = self._plugins.arbiter(name)

        def make_scripted(
            connections: Mapping[ResourceId, Connection], context: ArbiterContext
        ) -> Arbiter:
            if name == SIMULATED:
                connections = {
                    resource: replace(
                        each,
                        settings=sim_settings(
                            each.settings, self._answers.model.settings_of(resource)
                        ),
                    )
                    for resource, each in connections.items()
                }
            arbiter = make(connections, context)
            if isinstance(arbiter, SimArbiter):
                self.simulated.append(arbiter)
            scripted = ScriptedArbiter(arbiter, self._answers, context.logger, self)
            return cast("Arbiter", scripted)

        return make_scripted

    def service(self, name: str) -> Callable[[], Service]:
        """The service of that name, scripted. No plugin need provide it until it is run."""
        return lambda: ScriptedService(name, self)

    def service_writes(self) -> dict[str, tuple[str, ...]]:
        """What each service of the plugins writes."""
        return self._plugins.service_writes()

    def check_mission(self, mission: "Mission", fleet: "Fleet | None") -> list[Finding]:
        """The plugins' findings."""
        return self._plugins.check_mission(mission, fleet)

    def records_committed(self, run_id: str, records: "Sequence[Record]") -> None:
        """Pass records to the observers among the plugins."""
        self._plugins.records_committed(run_id, records)

    def entry(self, name: str, context: ServiceContext) -> ServiceEntry | None:
        """What a service does on this visit; None: it is run."""
        entry = self._answers.service(context.run, context.element, name, context.service)
        return entry or self._unscripted(name)

    def real_service(self, name: str) -> Service:
        """The plugins' own service of that name; errors as for the plugins."""
        return self._plugins.service(name)()


@dataclass(eq=False)
class ScriptedArbiter:
    """Decorates an arbiter: a behavior with an answer ends as that says.

    A simulated arbiter takes part in it. Any other does what it does, and a warning says so once
    for each element.
    """

    _arbiter: Arbiter
    _answers: Answers
    _logger: logging.Logger
    _plugins: ScriptedPlugins
    _warned: set[str] = field(default_factory=set)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._arbiter, name)

    async def hold(self, resource: ResourceId) -> None:
        """Hold a resource, if time advances."""
        if self._plugins.holds_wait():
            self._plugins.not_held[resource] = self._arbiter
        else:
            await self._arbiter.hold(resource)

    async def resume(self, resource: ResourceId) -> None:
        """Let a resource that was held go on."""
        if self._plugins.not_held.pop(resource, None) is None:
            await self._arbiter.resume(resource)

    async def start(self, request: BehaviorRequest) -> None:
        """Start a behavior, or a member's part of a team's, after saying how it ends."""
        run, number, *part = request.id.split(".", 2)
        scripted = self._answers.behavior(run, f"{run}.{number}")
        # Of a team's behavior each member's own part is scripted, not what it takes over later.
        own = part in ([], [*request.resources])
        if scripted is not None and own and scripted[1] != _SIMULATED:
            element, entry = scripted
            if isinstance(self._arbiter, SimArbiter):
                if entry.end == "simulated":
                    self._arbiter.scale_time(request.id, entry.factor)
                else:
                    error = entry.error or ""
                    self._arbiter.script(request.id, entry.after, entry.end, error)
            elif element not in self._warned:
                self._warned.add(element)
                self._logger.warning("answers for %s act on simulated arbiters only", element)
        await self._arbiter.start(request)


class ScriptedService:
    """Decorates a service: with an answer it waits, then writes or fails, and is not run."""

    def __init__(self, name: str, plugins: ScriptedPlugins) -> None:
        self.writes: Sequence[str] = ()
        self._name = name
        self._plugins = plugins

    async def run(
        self,
        context: ServiceContext,
        roles: Mapping[str, ResourceId],
        properties: Mapping[str, Value],
    ) -> Mapping[str, Value]:
        """Do what the answers say, else what the service does.

        Raises:
            ServiceError: the answers say so, or the service.
            PluginError: there is no answer, and no plugin provides the service.
        """
        entry = self._plugins.entry(self._name, context)
        if entry is None:
            service = self._plugins.real_service(self._name)
            self.writes = service.writes
            return await service.run(context, roles, properties)
        self.writes = tuple(entry.write)
        self._plugins.ending += 1
        try:
            await context.clock.sleep(entry.after)
        finally:
            self._plugins.ending -= 1
        if entry.error:
            raise ServiceError(entry.error, "as scripted")
        return entry.write
