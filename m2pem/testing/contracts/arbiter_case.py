"""What the tests of arbiters are given, and how they run on a bench."""

import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

import pytest

from m2pem.api.arbiter import Arbiter, ArbiterContext, ResolvedValue
from m2pem.api.clock import Clock
from m2pem.api.telemetry import VehicleState
from m2pem.executive.clock import run_virtual
from m2pem.model.catalogue import BehaviorState, ResourceId
from m2pem.testing.contracts.bench import ArbiterBench, context

START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z
STANDING_M_S = 0.1

MakeArbiter = Callable[[ArbiterContext], Arbiter]
CutLink = Callable[[Arbiter, ResourceId], None]
Main = Callable[[Clock], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class ArbiterCase:
    """What the tests command.

    `vehicle`, `other`: two vehicles that stand, ready to move. `long`: a behavior of both that
    moves for at least 30 s. `short`: one that ends well within `short_s`. `bad`: a parameter of
    `long` with a value that it cannot have.
    """

    vehicle: ResourceId
    other: ResourceId
    long: tuple[str, Mapping[str, ResolvedValue]]
    short: tuple[str, Mapping[str, ResolvedValue]]
    bad: tuple[str, ResolvedValue]
    short_s: float = 60.0


class ArbiterFixtures:
    """What authors override; see `ArbiterContract`."""

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
    def reconnects(self) -> bool:
        """Whether another arbiter finds the behaviors of one that was closed still running."""
        return True

    @pytest.fixture
    def run(self) -> Callable[[Main], None]:
        """Runs a test: in virtual time, unless overridden."""
        return lambda main: run_virtual(main, START_US)


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


def speed(bench: ArbiterBench, vehicle: ResourceId) -> float:
    """The speed that a vehicle said last, in m/s."""
    state = bench.latest(vehicle)
    if not isinstance(state, VehicleState) or state.velocity_enu_m_s is None:
        return 0.0
    return math.hypot(*state.velocity_enu_m_s)
