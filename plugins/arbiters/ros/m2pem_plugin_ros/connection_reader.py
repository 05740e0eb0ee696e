"""Reads a map of a fleet file strictly: what is unknown, or has no sense, is refused by name."""

import difflib
import re
from collections.abc import Collection, Mapping
from enum import StrEnum
from typing import Any, TypeVar

from m2pem.api import Dimension, ResourceId, UnitError, quantity
from m2pem.errors import PluginError

Choice = TypeVar("Choice", bound=StrEnum)

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NAME = re.compile(rf"/?{_TOKEN}(/{_TOKEN})*")
HIGHEST_DOMAIN = 232


class ConnectionReader:
    """The map at `connection`, or one inside of it, such as `connection.topics`.

    All methods raise PluginError; the text names the resource and the key.
    """

    def __init__(
        self, resource: ResourceId, values: Mapping[str, Any], path: str = "connection"
    ) -> None:
        self.resource = resource
        self.values = values
        self.path = path

    def error(self, key: str, problem: str) -> PluginError:
        """What is wrong with the value of a key."""
        return PluginError(f"{self.resource}: {self.path}.{key}: {problem}")

    def refuse_others(self, known: Collection[str]) -> None:
        """Nothing but these keys may be there."""
        for key in self.values:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, n=1)
                hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
                raise self.error(str(key), f"there is no such setting; {hint}")

    def inner(self, key: str, example: str) -> "ConnectionReader":
        """The map of a key; empty if it is not there."""
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(key, f"{value!r} is no map, such as {example}")
        return ConnectionReader(self.resource, value, f"{self.path}.{key}")

    def text(self, key: str, default: str) -> str:
        """A text that is not empty."""
        value = self.values.get(key, default)
        if key in self.values and (not isinstance(value, str) or not value.strip()):
            raise self.error(key, f"{value!r} is no text")
        return str(value)

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"{value!r} is neither true nor false")
        return value

    def choice(self, key: str, choices: type[Choice], default: Choice) -> Choice:
        """One of an enumeration."""
        value = self.values.get(key, default)
        try:
            return choices(value)
        except ValueError:
            raise self.error(key, f"{value!r} is none of {', '.join(choices)}") from None

    def domain_id(self) -> int | None:
        """The ROS domain; None: that of the environment."""
        value = self.values.get("domain_id")
        if value is None:
            return None
        whole = isinstance(value, int) and not isinstance(value, bool)
        if not whole or not 0 <= value <= HIGHEST_DOMAIN:
            raise self.error(
                "domain_id", f"{value!r} is not a whole number from 0 to {HIGHEST_DOMAIN}"
            )
        return int(value)

    def namespace(self, default: str | None = None) -> str:
        """With its leading "/"; "" is the root."""
        value = self.values.get("namespace", default)
        if value is None:
            raise self.error("namespace", "it is missing: that of the vehicle's nodes, as /evsg1")
        if value == "/" or (value == "" and default == ""):
            return ""
        if not isinstance(value, str) or not _NAME.fullmatch(value):
            raise self.error("namespace", f"{value!r} is no ROS namespace, such as /evsg1")
        return f"/{value.removeprefix('/')}"

    def topic(self, key: str, default: str) -> str:
        """The name of a topic."""
        value = self.values.get(key, default)
        if not isinstance(value, str) or not _NAME.fullmatch(value):
            raise self.error(key, f"{value!r} is no name of a ROS topic, such as {default}")
        return value

    def number(
        self, key: str, default: float, dimension: Dimension, *, zero: bool = False
    ) -> float:
        """A quantity in SI, above 0 or, with `zero`, not below it."""
        if key not in self.values:
            return default
        try:
            number = quantity(self.values[key], dimension)
        except UnitError as error:
            raise self.error(key, str(error)) from None
        return self._positive(key, number, zero)

    def _positive(self, key: str, number: float, zero: bool) -> float:
        if number < 0.0 or (number == 0.0 and not zero):
            raise self.error(key, f"{self.values[key]!r} is {'below' if zero else 'not above'} 0")
        return number
