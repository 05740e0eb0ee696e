"""Chooses faces, and serves them beside the runs."""

import asyncio
import importlib
import logging
from collections.abc import Callable
from dataclasses import replace

import click

from m2pem.api.capabilities import face_capabilities
from m2pem.api.control import MissionControl
from m2pem.api.face import Face, FaceSettings
from m2pem.cli.ocus import names_of
from m2pem.cli.options import UnusableError
from m2pem.errors import M2pemError, PluginError
from m2pem.fleet.fleet import Fleet
from m2pem.plugins import PluginManager

log = logging.getLogger("m2pem.face")


def chosen_faces(names: str | None, fleet: Fleet) -> tuple[str, ...]:
    """The faces that `--face` names, or the default: those of the fleet file.

    Raises:
        UsageError: `none` beside others.
    """
    return tuple(fleet.faces) if names is None else names_of("--face", names, "faces")


def with_faces_of_file(fleet: Fleet) -> Fleet:
    """Return a fleet of a journal with the faces of its file, which journals do not have.

    A file that cannot be read any more, or is that of another fleet, has none.
    """
    from m2pem.fleet.fleet_file import load_fleet  # slow, and only a resumed run needs it

    try:
        written = load_fleet(fleet.file)
    except M2pemError as error:
        log.info("faces: %s", error)
        return fleet
    return replace(fleet, faces=written.faces) if written.name == fleet.name else fleet


class Faces:
    """The faces that serve. One that breaks is reported, and stops nothing."""

    def __init__(self, names: str | None, fleet: Fleet, plugins: PluginManager) -> None:
        """Find the faces, and import what they need.

        Raises:
            UsageError: `--face` names one that there is not.
            UnusableError: the fleet file does.
        """
        self.names = chosen_faces(names, fleet)
        self._fleet = fleet
        try:
            self._factories = {name: plugins.face(name) for name in self.names}
        except PluginError as error:
            if names is not None:
                raise click.UsageError(str(error)) from error
            raise UnusableError(f"{fleet.file}: faces: {error}") from error
        for factory in self._factories.values():
            for module in face_capabilities(factory).imports:
                importlib.import_module(module)
        self._made: dict[str, Face] = {}
        self._tasks: list[asyncio.Task[None]] = []

    def make(self, control: MissionControl) -> None:
        """Make them, before anything begins: they read their settings.

        Raises:
            UnusableError: a setting is wrong.
        """
        for name, factory in self._factories.items():
            try:
                settings = FaceSettings(name, self._fleet.faces.get(name, {}))
                self._made[name] = factory(control, settings)
            except PluginError as error:
                raise UnusableError(f"{self._fleet.file}: {error}") from error

    def begin(self, broke: Callable[[str], None]) -> None:
        """Let them serve. `broke` is called with a text for operators when one has ended."""
        for name, face in self._made.items():
            self._tasks.append(asyncio.create_task(_serve(name, face, broke), name=name))

    async def end(self) -> None:
        """Cancel them, and wait until they have ended."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


async def _serve(name: str, face: Face, broke: Callable[[str], None]) -> None:
    try:
        await face.serve()
        why = "it ended by itself"
    except Exception as error:
        cause = _cause(error)
        why = str(cause)
        if not isinstance(cause, PluginError):
            log.exception("the face %s broke", name)
            why = f"{type(cause).__name__}: {cause}"
    broke(f"the face {name} does not serve any more: {why}; missions go on without it")


def _cause(error: Exception) -> Exception:
    """Return the first error within groups, which `asyncio.TaskGroup` raises."""
    while isinstance(error, ExceptionGroup):
        error = error.exceptions[0]
    return error
