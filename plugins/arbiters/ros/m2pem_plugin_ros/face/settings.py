"""The settings `faces.ros` of a fleet file (docs/ros-face.md)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from m2pem.api import Dimension, Fleet
from m2pem_plugin_ros.settings import HIGHEST_DOMAIN

if TYPE_CHECKING:
    from m2pem.api import FaceSettings

_TOKEN = r"[A-Za-z][A-Za-z0-9_]*"
_NAMESPACE = re.compile(rf"(/{_TOKEN})*")

FASTEST_HZ, SLOWEST_HZ = 100.0, 0.01

RATES: Mapping[str, float] = {
    "odom": 10.0,
    "tf": 10.0,
    "imu": 10.0,
    "joint_states": 10.0,
    "fix": 5.0,
    "battery_state": 1.0,
}
"""The highest rate of each topic of a vehicle, in Hz. Telemetry that comes more slowly is published
when it comes."""

KEYS = ("namespace", "domain_id", "rate", "commands", "receive", "send")
"""`receive` and `send`: event_settings.py."""


@dataclass(frozen=True, slots=True)
class Options:
    """The settings of the face. `namespace`: with its leading "/"; "": none. `domain_id` None: that
    of the environment. `commands`: the vehicles that take commands. `missions`: whether missions
    may be started."""

    namespace: str = ""
    domain_id: int | None = None
    rates: Mapping[str, float] = field(default_factory=lambda: dict(RATES))
    commands: frozenset[str] = frozenset()
    missions: bool = False

    def takes_commands(self, resource: str) -> bool:
        """Whether a vehicle, or the vehicle of a payload, may be commanded through the face."""
        return resource.partition("/")[0] in self.commands


def read_options(settings: "FaceSettings", fleet: Fleet) -> Options:
    """Read the settings.

    Raises:
        PluginError: one is wrong; the text names its key.
    """
    settings.refuse_others(KEYS)
    domain_id = settings.values.get("domain_id")
    return Options(
        _namespace(settings),
        None if domain_id is None else settings.whole("domain_id", None, 0, HIGHEST_DOMAIN),
        _rates(settings),
        settings.vehicles("commands", fleet.vehicles),
        settings.values.get("commands") == "all",
    )


def _namespace(settings: "FaceSettings") -> str:
    value = settings.text("namespace", "/").strip().strip("/")
    namespace = f"/{value}" if value else ""
    if not _NAMESPACE.fullmatch(namespace) or "__" in namespace:
        raise settings.error("namespace", f"{value!r} is not a ROS namespace such as /site_a")
    return namespace


def _rates(settings: "FaceSettings") -> Mapping[str, float]:
    """One rate for all topics, or a map of rates by topic."""
    value = settings.values.get("rate")
    if not isinstance(value, Mapping):
        if value is None:
            return dict(RATES)
        rate = settings.quantity("rate", 10.0, Dimension.FREQUENCY, SLOWEST_HZ, FASTEST_HZ)
        return dict.fromkeys(RATES, rate)
    inner = settings.inner("rate", "{odom: 20 Hz}")
    inner.refuse_others(RATES)
    return {
        topic: inner.quantity(topic, usual, Dimension.FREQUENCY, SLOWEST_HZ, FASTEST_HZ)
        for topic, usual in RATES.items()
    }
