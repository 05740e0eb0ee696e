"""Reading what a fleet file says about a connection, with errors that name resource and key."""

import math
from collections.abc import Collection, Mapping
from enum import StrEnum
from typing import Any, Self, TypeVar

from m2pem.errors import PluginError
from m2pem.mission.catalogue import ResourceId
from m2pem.suggestions import did_you_mean, nearest
from m2pem.units import Dimension, UnitError, quantity

Choice = TypeVar("Choice", bound=StrEnum)


class ConnectionReader:
    """Reads the map at `connection`, or an inner map such as `connection.topics`.

    An arbiter that has further kinds of values derives a class from this one. All methods raise
    PluginError; the text names the resource and the key.
    """

    def __init__(
        self, resource: ResourceId, values: Mapping[str, Any], path: str = "connection"
    ) -> None:
        self.resource = resource
        self.values = values
        self.path = path

    def error(self, key: str, problem: str) -> PluginError:
        """Return the error for the value of a key."""
        return PluginError(f"{self.resource}: {self.path}.{key}: {problem}")

    def refuse_others(self, known: Collection[str]) -> None:
        """Raise an error for keys other than these."""
        for key in self.values:
            if key not in known:
                hint = did_you_mean(str(key), known) or f"known: {', '.join(known)}"
                raise self.error(str(key), f"there is no such setting; {hint}")

    def refuse_misspelled(self, known: Collection[str]) -> None:
        """Raise an error for unknown keys that are spelled like one of these, which is missing.

        For payloads: they inherit the settings of their vehicle, which may have another arbiter, so
        that keys that are only unknown are no error.
        """
        for key in self.values:
            near = nearest(str(key), known) if key not in known else ""
            if near and near not in self.values:
                raise self.error(str(key), f"there is no such setting; did you mean '{near}'?")

    def inner(self, key: str, example: str) -> Self:
        """Return the reader of an inner map; it is empty if the key is missing."""
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, f"{value!r} is not a map such as {example}")
        return type(self)(self.resource, value, f"{self.path}.{key}")

    def text(self, key: str, default: str) -> str:
        """Return a text that is not empty."""
        value = self.values.get(key, default)
        if key in self.values and (not isinstance(value, str) or not value.strip()):
            raise self.error(key, f"{value!r} is not a text")
        return str(value)

    def flag(self, key: str, default: bool) -> bool:
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"{value!r} is neither true nor false")
        return value

    def choice(self, key: str, choices: type[Choice], default: Choice) -> Choice:
        """Return a member of an enumeration."""
        value = self.values.get(key, default)
        try:
            return choices(value)
        except ValueError:
            raise self.error(key, f"{value!r} is none of {', '.join(choices)}") from None

    def whole(
        self, key: str, default: int | None, lowest: int, highest: int, what: str = ""
    ) -> int:
        """Return a whole number. Without a default it is required, and `what` describes it in the
        error."""
        value = self.values.get(key, default)
        if value is None:
            raise self.error(key, f"it is missing: {what}, {lowest} to {highest}")
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if not is_whole or not lowest <= value <= highest:
            raise self.error(key, f"{value!r} is not a whole number from {lowest} to {highest}")
        return int(value)

    def number(self, key: str, default: float, lowest: float, highest: float) -> float:
        """Return a number without a unit."""
        value = self.values.get(key, default)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not lowest <= value <= highest:
            raise self.error(key, f"{value!r} is not a number from {lowest:g} to {highest:g}")
        return float(value)

    def quantity(
        self,
        key: str,
        default: float,
        dimension: Dimension,
        lowest: float = -math.inf,
        highest: float = math.inf,
    ) -> float:
        """Return a quantity in SI, as are `default`, `lowest` and `highest`."""
        if key not in self.values:
            return default
        return self.quantity_of(key, self.values[key], dimension, lowest, highest)

    def quantity_of(
        self, key: str, value: Any, dimension: Dimension, lowest: float, highest: float
    ) -> float:
        """Return one of the values at a key as a quantity in SI."""
        try:
            read = quantity(value, dimension)
        except UnitError as error:
            raise self.error(key, str(error)) from None
        if not lowest <= read <= highest:
            raise self.error(key, f"{value!r} is not within {lowest:g} and {highest:g} (SI)")
        return read
