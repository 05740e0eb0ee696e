"""Runs service tasks: one asyncio task each, cancelled when the mission moves on."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from typing import Protocol

from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.engine.commands import RunService
from m2pem.engine.inputs import Input, ServiceCompleted, ServiceFailed
from m2pem.errors import PluginError
from m2pem.executive.script import Script, ScriptedService
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.values import Value

log = logging.getLogger("m2pem.service")

SERVICE_FAILED = "FAILED"
"""Error code of a task whose service is missing or raised something that is no ServiceError."""


class Poster(Protocol):
    """A run, as services see it."""

    id: str

    def post(self, item: Input) -> None:
        """Hand in what happened."""
        ...


class Services:
    """`find` gives the registered factory of a service, or raises PluginError."""

    def __init__(
        self,
        find: Callable[[str], Callable[[], Service]],
        context: ServiceContext,
        script: Script | None = None,
    ) -> None:
        self._find = find
        self._context = context
        self._script = script
        self._tasks: dict[tuple[str, str], asyncio.Task[None]] = {}

    def run(self, run: Poster, command: RunService) -> None:
        """Run a service; what comes of it is posted to the run."""
        scripted = None
        if self._script is not None:
            scripted = self._script.service(run.id, command.element, command.name, command.service)
        key = (run.id, command.service)
        task = asyncio.create_task(self._serve(run, command, scripted))
        self._tasks[key] = task
        task.add_done_callback(lambda _: self._tasks.pop(key, None))

    def cancel(self, run: str, service: str) -> None:
        """The mission has moved on."""
        task = self._tasks.get((run, service))
        if task is not None:
            task.cancel()

    async def close(self) -> None:
        """End all of them."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(
        self, run: Poster, command: RunService, scripted: ScriptedService | None
    ) -> None:
        try:
            written = await self._written(command, scripted)
        except ServiceError as error:
            run.post(ServiceFailed(command.service, error.code, error.reason))
        except PluginError as error:
            run.post(ServiceFailed(command.service, SERVICE_FAILED, str(error)))
        except Exception as error:  # a service's fault must not end the executive
            log.exception("service %s of %s raised", command.name, command.element)
            reason = f"{command.name} raised {type(error).__name__}: {error}"
            run.post(ServiceFailed(command.service, SERVICE_FAILED, reason))
        else:
            run.post(ServiceCompleted(command.service, dict(written)))

    async def _written(
        self, command: RunService, scripted: ScriptedService | None
    ) -> Mapping[str, Value]:
        if scripted is not None:
            await self._context.clock.sleep(scripted.after_s)
            if scripted.error:
                raise ServiceError(scripted.error, "as scripted")
            return scripted.write or {}
        service = self._find(command.name)()
        roles = {role: ResourceId(names[0]) for role, names in command.roles.items() if names}
        written = await service.run(self._context, roles, command.properties)
        undeclared = [key for key in written if not _declared(key, service.writes)]
        if undeclared:
            raise PluginError(
                f"service {command.name} wrote {', '.join(undeclared)}, which its `writes`"
                " does not declare"
            )
        return written


def _declared(key: str, writes: object) -> bool:
    names = writes if isinstance(writes, (list, tuple, set, frozenset)) else ()
    return any(key == name or key.startswith(f"{name}.") for name in names)
