"""What the tests of arbiters are given, and how they run on a bench."""

import asyncio
import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

from m2pem.api.arbiter import Arbiter, ArbiterContext, ResolvedValue
from m2pem.api.clock import Clock
from m2pem.api.telemetry import LinkState, VehicleState
from m2pem.executive.clock import SystemClock, run_virtual
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.testing.contracts.bench import ArbiterBench, context
from m2pem.testing.contracts.contract import Contract

START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z
MakeArbiter = Callable[[ArbiterContext], Arbiter]
CutLink = Callable[[Arbiter, ResourceId], None]
Effects = Callable[[Arbiter, ResourceId], int]
Main = Callable[[Clock], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class ArbiterCase:
    """What the tests command.

    `vehicle`, `other`: two vehicles that stand, ready to move (the same one, if a second vehicle is
    not supported). `watch_s`: for how long a test watches that nothing happens that must not.
    `long`: a behavior of both that moves for at least five times as long. `short`: one that ends
    well within `short_s`. `bad`: a parameter of `long` with a value that it cannot have. Slower
    than `standing_m_s` a vehicle stands (a boat drifts). Seconds are those of the clock that the
    arbiter is lent.
    """

    vehicle: ResourceId
    other: ResourceId
    long: tuple[str, Mapping[str, ResolvedValue]]
    short: tuple[str, Mapping[str, ResolvedValue]]
    bad: tuple[str, ResolvedValue]
    short_s: float = 60.0
    watch_s: float = 6.0
    standing_m_s: float = 0.1


class ArbiterFixtures(Contract):
    """What authors override; see `ArbiterContract`."""

    m2pem_contract: ClassVar[str] = "ArbiterContract"
    subjects: ClassVar[Mapping[str, str]] = {
        "effects": "the fixture `effects` counts what a vehicle physically began",
        "hold": "`hold` brings a vehicle to a stand and `resume` lets it go on",
        "link": "the fixture `cut_link` makes a vehicle unheard, and its behavior is LOST",
        "preempt": "a behavior takes a vehicle over from one that is being cancelled",
        "reconnect": "a behavior outlives the arbiter, and another one finds it again",
        "return": "the fixture `mend_link` lets a vehicle be heard again that was lost",
        "second vehicle": "there are two vehicles",
        "telemetry": "vehicles say where they are and how fast",
        "virtual clock": "all that takes time takes it of the clock that was lent",
    }
    speed: ClassVar[float] = 1.0
    """Where a virtual clock is not supported: seconds of the clock in a real second. The vehicles,
    or what simulates them, must be as fast."""

    @pytest.fixture
    def make_arbiter(self) -> MakeArbiter:
        """Makes an arbiter, not connected yet. Made again, it reaches the same vehicles."""
        raise NotImplementedError("override the fixture `make_arbiter`")

    @pytest.fixture
    def case(self) -> ArbiterCase:
        """What to command."""
        raise NotImplementedError("override the fixture `case`")

    @pytest.fixture
    def cut_link(self) -> CutLink | None:
        """A function that makes a vehicle unheard; None: not supported."""
        return None

    @pytest.fixture
    def mend_link(self) -> CutLink | None:
        """A function that lets a vehicle be heard again that `cut_link` made unheard, and that went
        on meanwhile; None: not supported."""
        return None

    @pytest.fixture
    def effects(self) -> Effects | None:
        """How many motions a vehicle has begun, by its own count, not the arbiter's; None: not
        supported."""
        return None

    @pytest.fixture
    def run(self) -> Callable[[Main], None]:
        """Runs a test: in virtual time, or else on a real clock of `speed`."""
        if "virtual clock" in self.unsupported:
            return lambda main: asyncio.run(_real(main, self.speed))
        return lambda main: run_virtual(main, START_US)


async def _real(main: Main, speed: float) -> None:
    await main(SystemClock(speed))


def on_bench(
    make_arbiter: MakeArbiter,
    run: Callable[[Main], None],
    main: Callable[[ArbiterBench], Awaitable[None]],
) -> None:
    """Run `main` with a connected arbiter."""

    async def connected(clock: Clock) -> None:
        async with ArbiterBench(make_arbiter(context(clock)), clock) as bench:
            await main(bench)

    run(connected)


async def start(
    bench: ArbiterBench,
    id_: str,
    behavior: tuple[str, Mapping[str, ResolvedValue]],
    *resources: ResourceId,
    **options: Any,
) -> None:
    """Start a behavior of the case."""
    name, parameters = behavior
    await bench.start(id_, name, *resources, **options, **dict[str, Any](parameters))


def terminal(bench: ArbiterBench, id_: str) -> list[BehaviorState]:
    """The terminal states that were reported of a behavior."""
    return [state for state in bench.states_of(id_) if state.terminal]


def heard(bench: ArbiterBench, vehicle: ResourceId) -> bool:
    """Whether the last that a vehicle said is that its link is up."""
    state = bench.latest(vehicle)
    return state is not None and state.link is not LinkState.LOST


def speed(bench: ArbiterBench, vehicle: ResourceId) -> float:
    """The speed that a vehicle said last, in m/s."""
    state = bench.latest(vehicle)
    if not isinstance(state, VehicleState) or state.velocity_enu_m_s is None:
        return 0.0
    return math.hypot(*state.velocity_enu_m_s)


def is_standing(bench: ArbiterBench, case: ArbiterCase) -> bool:
    """Whether the vehicle stands."""
    return speed(bench, case.vehicle) < case.standing_m_s


def is_moving(bench: ArbiterBench, case: ArbiterCase) -> bool:
    """Whether the vehicle clearly moves."""
    return speed(bench, case.vehicle) > 2 * case.standing_m_s
