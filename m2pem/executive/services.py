"""Runs service tasks: one asyncio task each, cancelled when the mission moves on."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

from m2pem.api.service import Service, ServiceContext, ServiceError
from m2pem.engine.commands import RunService
from m2pem.engine.inputs import Input, ServiceCompleted, ServiceFailed
from m2pem.errors import PluginError
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
    ) -> None:
        self._find = find
        self._context = context
        self._tasks: dict[tuple[str, str], asyncio.Task[None]] = {}

    def run(self, run: Poster, command: RunService) -> None:
        """Run a service; what comes of it is posted to the run."""
        key = (run.id, command.service)
        task = asyncio.create_task(self._serve(run, command))
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

    async def _serve(self, run: Poster, command: RunService) -> None:
        try:
            written = await self._written(run.id, command)
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

    async def _written(self, run: str, command: RunService) -> Mapping[str, Value]:
        service = self._find(command.name)()
        roles = {role: ResourceId(names[0]) for role, names in command.roles.items() if names}
        context = replace(self._context, run=run, element=command.element, service=command.service)
        written = await service.run(context, roles, command.properties)
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
