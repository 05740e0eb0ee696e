"""What a translation assumes about the world around a mission."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.fleet.graph import Catalogue
from m2pem.mission.expression import Expression
from m2pem.mission.values import Value
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.translate.ways import KnownWays


@dataclass(frozen=True, slots=True)
class Options:
    """Assumptions of a translation.

    `data`: what the run is started with. `service_writes`: names that each service writes, by
    class; one that is not listed may write any name that nothing else writes. `open_world`: every
    signal and message may come from outside, not only those that operators are expected to send.
    `instances`: how many parallel instances of an activity, and of a process that triggers start,
    are modelled when the mission does not state their number. `calls`: how often a process may be
    called within itself. `assumed`: what is taken not to happen. `timers_in_order`: of timers that
    begin to run together, the one that is due first fires first. `catalogue`: what each resource
    offers; None: all that the mission asks for. `distinguished`: resources that requirements are
    about. `all_pools`: the pools of a collaboration that nothing triggers begin with the run.
    `ways`: where vehicles go, so that shared space is followed; None: it is taken to be free.
    """

    data: Mapping[str, Value] = field(default_factory=dict)
    service_writes: Mapping[str, Sequence[str]] = field(default_factory=dict)
    open_world: bool = False
    instances: int = 2
    calls: int = 1
    assumed: Assumptions = NOTHING
    timers_in_order: bool = False
    conditions: Sequence[Expression] = ()
    """Conditions of requirements on the data of the process that the run begins with."""
    catalogue: Catalogue | None = None
    distinguished: Collection[str] = ()
    all_pools: bool = False
    ways: KnownWays | None = None
    most_instances: int = 8
    """Most instances of a number that the mission states; above, `instances` are checked."""
    most_in_turn: int = 128
    """The same of tasks that do their work in one step, one after the other."""

    @property
    def failures(self) -> bool:
        """Whether behaviors and services may fail."""
        return self.assumed.failures != 0
