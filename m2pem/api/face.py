"""A face: shows the fleet and its runs to programs that speak another protocol."""

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from m2pem.api.connection_reader import ConnectionReader
from m2pem.errors import PluginError
from m2pem.mission.catalogue import ResourceId
from m2pem.suggestions import did_you_mean

if TYPE_CHECKING:
    from m2pem.api.control import MissionControl

ALL, NONE = "all", "none"
"""In place of a list of vehicles."""


class FaceSettings(ConnectionReader):
    """Reads what a fleet file says at `faces: {NAME: ...}`; errors name `faces.NAME.KEY`."""

    def __init__(self, face: str, values: Mapping[str, Any], path: str = "") -> None:
        super().__init__(ResourceId(face), values, path or f"faces.{face}")

    def error(self, key: str, problem: str) -> PluginError:
        """Return the error for the value of a key."""
        return PluginError(f"{self.path}.{key}: {problem}")

    def vehicles(self, key: str, known: Collection[ResourceId]) -> frozenset[ResourceId]:
        """Return the vehicles of a key whose value is `none`, as it is by default, `all`, or a list
        of names. `known`: the vehicles of the fleet."""
        value = self.values.get(key, NONE)
        if value in (ALL, NONE):
            return frozenset(known if value == ALL else ())
        if not isinstance(value, list):
            raise self.error(key, f"{value!r} is none of {NONE}, {ALL}, and a list of vehicles")
        for name in value:
            self.vehicle(key, name, known)
        return frozenset(map(ResourceId, value))

    def vehicle(self, key: str, name: object, known: Collection[ResourceId]) -> ResourceId:
        """Return one of the vehicles that a key names."""
        if not isinstance(name, str) or name not in known:
            hint = did_you_mean(str(name), known) or f"known: {', '.join(known)}"
            raise self.error(key, f"the fleet has no vehicle '{name}'; {hint}")
        return ResourceId(name)


class Face(Protocol):
    """Constructed as `Face(control, settings)`; several may serve at once.

    A face uses `MissionControl` alone. What it commands on request of others goes through
    `execute_behavior`, `start`, `take` and `give_back`, with `by` naming who asked. A program on
    its other side that is slow, or gone, loses what it was to be sent; it delays nothing here.

    The class may declare `capabilities`, an `m2pem.api.FaceCapabilities`.
    """

    def __init__(self, control: "MissionControl", settings: FaceSettings) -> None:
        """Read the settings; nothing is opened yet.

        Raises:
            PluginError: a setting is wrong.
        """
        ...

    async def serve(self) -> None:
        """Serve until cancelled.

        Raises:
            PluginError: what it needs cannot be opened, such as a port.
        """
        ...
