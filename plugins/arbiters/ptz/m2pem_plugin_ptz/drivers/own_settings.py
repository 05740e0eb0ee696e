"""Reads the keys of a camera's connection that are its driver's own.

A camera inherits the connection of its vehicle, whose arbiter may be any: so a key that is not
known is no mistake, unless it looks like one of ours.
"""

import difflib
from collections.abc import Collection, Mapping, Sequence
from enum import StrEnum
from typing import Any, TypeVar

from m2pem.api import Connection, ResourceId
from m2pem.errors import PluginError

Choice = TypeVar("Choice", bound=StrEnum)

SIMILAR = 0.8
"""So similar (0 to 1) to one of ours is a key that is taken for a slip of the pen."""


class OwnSettings:
    """The map at `connection`, or one inside of it.

    All methods raise PluginError; the text names the resource and the key.
    """

    def __init__(
        self, resource: ResourceId, values: Mapping[str, Any], path: str = "connection"
    ) -> None:
        self.values = values
        self._resource = resource
        self._path = path

    @classmethod
    def of(cls, connection: Connection) -> "OwnSettings":
        """Those of a camera."""
        return cls(connection.resource, connection.settings)

    def error(self, key: str, problem: str) -> PluginError:
        """What is wrong with the value of a key."""
        return PluginError(f"{self._resource}: {self._path}.{key}: {problem}")

    def refuse_slips(self, known: Collection[str]) -> None:
        """No key may look like one of these without being one."""
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, n=1, cutoff=SIMILAR)
                if near and near[0] not in self.values:
                    raise self.error(
                        str(key), f"there is no such setting; did you mean '{near[0]}'?"
                    )

    def refuse_others(self, known: Sequence[str]) -> None:
        """Nothing but these keys may be there."""
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, n=1)
                hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
                raise self.error(str(key), f"there is no such setting; {hint}")

    def inner(self, key: str, example: str) -> "OwnSettings":
        """The map of a key; empty if it is not there."""
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, f"{value!r} is no map, such as {example}")
        return OwnSettings(self._resource, value, f"{self._path}.{key}")

    def whole(self, key: str, default: int | None, lowest: int, highest: int, what: str) -> int:
        """A whole number; without a default it must be there. `what`: for people."""
        value = self.values.get(key, default)
        if value is None:
            raise self.error(key, f"it is missing: {what}, {lowest} to {highest}")
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if not is_whole or not lowest <= value <= highest:
            raise self.error(key, f"{value!r} is not a whole number from {lowest} to {highest}")
        return int(value)

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"{value!r} is neither true nor false")
        return value

    def text(self, key: str, default: str) -> str:
        """A text; one that is there is not empty."""
        value = self.values.get(key, default)
        if key in self.values and (not isinstance(value, str) or not value.strip()):
            raise self.error(key, f"{value!r} is no text")
        return str(value)

    def choice(self, key: str, choices: type[Choice], default: Choice) -> Choice:
        """One of an enumeration."""
        value = self.values.get(key, default)
        try:
            return choices(value)
        except ValueError:
            raise self.error(key, f"{value!r} is none of {', '.join(choices)}") from None
