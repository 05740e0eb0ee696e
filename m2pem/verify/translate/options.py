"""What a derivation assumes about the world around a mission."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.mission.expression import Expression
from m2pem.mission.values import Value


@dataclass(frozen=True, slots=True)
class Options:
    """Assumptions.

    `data`: what the run is started with. `service_writes`: names that each service writes, by
    class; one that is not listed may write any name that nothing else writes. `open_world`: every
    signal and message may come from outside, not only those that operators are expected to send.
    `instances`: how many parallel instances of an activity, and of a process that is begun again
    and again, are told apart when the mission does not say how many there are. `calls`: how often
    a process may be called within itself. `failures`: behaviors and services may fail.
    `timers_in_order`: of timers that begin to run together, the one that is due first comes first.
    """

    data: Mapping[str, Value] = field(default_factory=dict)
    service_writes: Mapping[str, Sequence[str]] = field(default_factory=dict)
    open_world: bool = False
    instances: int = 2
    calls: int = 1
    failures: bool = True
    timers_in_order: bool = False
    conditions: Sequence[Expression] = ()
    """What else is asked of the data of the process that the run begins with: by requirements."""
    most_instances: int = 8
    """Of a number that the mission says; above, `instances` are checked."""
