"""The harness of arbiter tests: it records the reports and states of an arbiter.

`ArbiterCase` says what the tests command; `ArbiterFixtures` has what authors override.
"""

import asyncio
import functools
import inspect
import logging
import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, ClassVar
from uuid import UUID

import pytest

from m2pem.api.arbiter import (
    Arbiter,
    ArbiterContext,
    BehaviorReport,
    BehaviorRequest,
    ResolvedValue,
)
from m2pem.api.clock import Clock, SystemClock, run_virtual
from m2pem.api.telemetry import LinkState, PayloadState, TeamState, VehicleState
from m2pem.conformance.bounds import Bounds
from m2pem.conformance.derivation import commanded_by
from m2pem.conformance.watch import Watch
from m2pem.errors import StaleCommandError
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.telemetry.bus import Bus
from m2pem.testing.contracts.contract import Contract, takes

ORIGIN = (38.1075, -77.3192, 60.0)
JOURNAL = UUID("3f0e7d0a-6a51-4f5c-9a2c-0c1a7b1f2d11")
"""The identity of the journal in tests: a second arbiter takes up what the first has left."""


def context(
    clock: Clock, teams: Mapping[str, tuple[ResourceId, ...]] | None = None, epoch: int = 0
) -> ArbiterContext:
    """Return a context as an executive gives it to an arbiter; `epoch`: with which it drives every
    run, 0: it drives none."""
    logger = logging.getLogger("m2pem.testing")
    return ArbiterContext(clock, Bus(), logger, ORIGIN, teams or {}, JOURNAL, lambda _: epoch)


class ArbiterHarness:
    """An arbiter while it is connected: `async with ArbiterHarness(arbiter, clock) as harness`.

    `reports` and `states`: all that it has sent so far.
    """

    def __init__(self, arbiter: Arbiter, clock: Clock) -> None:
        self.arbiter = arbiter
        self.clock = clock
        self.reports: list[BehaviorReport] = []
        self.states: list[VehicleState | PayloadState] = []
        self._news = asyncio.Event()
        self._readers: list[asyncio.Task[None]] = []

    @property
    def late_s(self) -> float:
        """Tolerated delay of a report in seconds: a computer may be busy for two real seconds."""
        return 2.0 * self.clock.speed if isinstance(self.clock, SystemClock) else 0.0

    async def __aenter__(self) -> "ArbiterHarness":
        await self.arbiter.connect()
        self._readers = [
            asyncio.create_task(self._read_reports()),
            asyncio.create_task(self._read_states()),
        ]
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.arbiter.close()
        if error is None:
            done, late = await asyncio.wait(self._readers, timeout=5)
            for reader in late:
                reader.cancel()
            assert not late, "reports() and telemetry() end when the arbiter is closed"
            for reader in done:
                reader.result()
        else:
            for reader in self._readers:
                reader.cancel()

    async def start(
        self,
        id_: str,
        behavior: str,
        *resources: str,
        epoch: int = 1,
        preempts: tuple[str, ...] = (),
        **parameters: ResolvedValue,
    ) -> None:
        """Start a behavior on resources."""
        ids = tuple(ResourceId(resource) for resource in resources)
        request = BehaviorRequest(id_, epoch, behavior, parameters, ids, preempts=preempts)
        await self.arbiter.start(request)

    def of(self, id_: str) -> list[BehaviorReport]:
        """Return the reports of one behavior."""
        return [report for report in self.reports if report.id == id_]

    def states_of(self, id_: str) -> list[BehaviorState]:
        """Return the reported states of one behavior, without the reports that say only what is
        left of it."""
        reports = self.of(id_)
        return [
            report.state
            for last, report in zip([None, *reports], reports, strict=False)
            if last is None or last.state is not report.state or last.remaining == report.remaining
        ]

    def latest(self, resource: str) -> VehicleState | PayloadState | None:
        """Return the latest state of a resource."""
        return next((s for s in reversed(self.states) if s.resource == resource), None)

    async def until(self, true: Callable[[], bool], within_s: float) -> bool:
        """Wait until `true` returns true; False: it did not within `within_s` seconds."""
        limit = asyncio.create_task(self.clock.sleep(within_s))
        try:
            while not true():
                if limit.done():
                    return False
                self._news.clear()
                news = asyncio.create_task(self._news.wait())
                await asyncio.wait([limit, news], return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
            return True
        finally:
            limit.cancel()

    async def running(self, id_: str, within_s: float = 60.0) -> None:
        """Wait until a behavior runs."""
        running = await self.until(lambda: BehaviorState.RUNNING in self.states_of(id_), within_s)
        assert running, f"{id_} was not RUNNING within {within_s:g} s; its reports: {self.of(id_)}"

    async def ended(self, id_: str, within_s: float) -> BehaviorReport:
        """Wait for the terminal report of a behavior."""
        over = await self.until(
            lambda: any(state.terminal for state in self.states_of(id_)), within_s
        )
        assert over, f"{id_} had not ended within {within_s:g} s; its reports: {self.of(id_)}"
        return self.of(id_)[-1]

    async def _read_reports(self) -> None:
        async for report in self.arbiter.reports():
            self.reports.append(report)
            self._news.set()

    async def _read_states(self) -> None:
        async for state in self.arbiter.telemetry():
            if isinstance(state, TeamState):
                continue
            self.states.append(state)
            self._news.set()


START_US = 1_767_225_600_000_000  # 2026-01-01T00:00:00Z
MakeArbiter = Callable[[ArbiterContext], Arbiter]
CutLink = Callable[[Arbiter, ResourceId], None]
Effects = Callable[[Arbiter, ResourceId], int]
IsArbiters = Callable[["asyncio.Task[Any]"], bool]
Main = Callable[[Clock], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class ArbiterCase:
    """The vehicles and behaviors of the tests.

    `vehicle`, `other`: two vehicles at rest, ready to move (the same one, if a second vehicle is
    not supported). `watch_s`: for how long a test watches that nothing forbidden happens. `long`: a
    behavior of both that moves for at least five times as long. `short`: one that ends well within
    `short_s`. `bad`: a parameter of `long` with a value that it cannot have. A vehicle slower than
    `standing_m_s` is at rest (a boat drifts). `route`: a behavior with the parameter `route` that
    ends within `route_s`, of which the arbiter reports what is left; None: it offers none. Seconds
    are those of the clock of the arbiter's context.
    """

    vehicle: ResourceId
    other: ResourceId
    long: tuple[str, Mapping[str, ResolvedValue]]
    short: tuple[str, Mapping[str, ResolvedValue]]
    bad: tuple[str, ResolvedValue]
    short_s: float = 60.0
    watch_s: float = 6.0
    standing_m_s: float = 0.1
    route: tuple[str, Mapping[str, ResolvedValue]] | None = None
    route_s: float = 300.0


class ArbiterFixtures(Contract):
    """The fixtures that authors override; see `ArbiterContract`."""

    m2pem_contract: ClassVar[str] = "ArbiterContract"
    subjects: ClassVar[Mapping[str, str]] = {
        "effects": "the fixture `effects` counts what a vehicle physically began",
        "hold": "`hold` stops a vehicle and `resume` lets it continue",
        "link": "the fixture `cut_link` cuts the link of a vehicle, and its behavior is LOST",
        "preempt": "a behavior takes a vehicle over from one that is being cancelled",
        "reconnect": "a behavior outlives the arbiter, and another one finds it again",
        "remaining": "reports say what is left of a route, as parameters for another vehicle",
        "return": "the fixture `mend_link` restores the link of a vehicle that was lost",
        "second vehicle": "there are two vehicles",
        "telemetry": "vehicles report their position and velocity",
        "virtual clock": "all durations are those of the context's clock",
    }
    speed: ClassVar[float] = 1.0
    """Without a virtual clock: seconds of the clock in a real second. The vehicles, or their
    simulator, must run as fast."""

    @pytest.fixture
    def make_arbiter(self) -> MakeArbiter:
        """A function that makes an arbiter, not connected yet, always of the same vehicles."""
        raise NotImplementedError("override the fixture `make_arbiter`")

    @pytest.fixture
    def case(self) -> ArbiterCase:
        """The vehicles and behaviors of the tests."""
        raise NotImplementedError("override the fixture `case`")

    @pytest.fixture
    def cut_link(self) -> CutLink | None:
        """A function that cuts the link of a vehicle; None: not supported."""
        return None

    @pytest.fixture
    def mend_link(self) -> CutLink | None:
        """A function that restores the link that `cut_link` has cut, to a vehicle that continued
        its behavior meanwhile; None: not supported."""
        return None

    @pytest.fixture
    def effects(self) -> Effects | None:
        """A function that returns how many motions a vehicle has begun, by its own count, not the
        arbiter's; None: not supported."""
        return None

    @pytest.fixture
    def is_arbiters(self) -> IsArbiters:
        """A function that tells tasks of the arbiter from those of a simulator in the same event
        loop, which may go on for a moment when the arbiter is closed; by default all are its."""
        return lambda _: True

    @pytest.fixture
    def run(self) -> Callable[[Main], None]:
        """A function that runs a test: in virtual time, or else on a real clock of `speed`."""
        if "virtual clock" in self.unsupported:
            return lambda main: asyncio.run(_real(main, self.speed))
        return lambda main: run_virtual(main, START_US)


async def _real(main: Main, speed: float) -> None:
    await main(SystemClock(speed))


def connected(test: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """Make a test of a coroutine method, which gets a connected arbiter as `harness`, and other
    fixtures by their names."""

    @functools.wraps(test)
    def run_test(
        self: object, make_arbiter: MakeArbiter, run: Callable[[Main], None], **fixtures: Any
    ) -> None:
        async def main(clock: Clock) -> None:
            async with ArbiterHarness(make_arbiter(context(clock)), clock) as harness:
                await test(self, harness=harness, **fixtures)

        run(main)

    own = (name for name in inspect.signature(test).parameters if name not in ("self", "harness"))
    return takes(run_test, *own, "make_arbiter", "run")


async def start(
    harness: ArbiterHarness,
    id_: str,
    behavior: tuple[str, Mapping[str, ResolvedValue]],
    *resources: ResourceId,
    **options: Any,
) -> None:
    """Start a behavior of the case."""
    name, parameters = behavior
    await harness.start(id_, name, *resources, **options, **dict[str, Any](parameters))


async def has_evidence(
    harness: ArbiterHarness, case: ArbiterCase, behavior: tuple[str, Mapping[str, ResolvedValue]]
) -> None:
    """Check that telemetry shows what the success of a behavior of the case promises: at once, or
    soon, as a report may overtake it."""
    name, parameters = behavior
    request = BehaviorRequest("r1.b1", 1, name, parameters, (case.vehicle,))
    said = next((each.commanded for each in harness.of("r1.b1") if each.commanded), None)
    watch, taken = Watch(said or commanded_by(request), Bounds()), 0

    def missing() -> str:
        nonlocal taken
        for state in harness.states[taken:]:
            if isinstance(state, VehicleState) and state.resource == case.vehicle:
                watch.observe(state)
        taken = len(harness.states)
        return watch.missing()

    seen = await harness.until(lambda: not missing(), case.watch_s)
    assert seen, f"SUCCEEDED, and telemetry shows: {missing()}"


async def refusal(call: Awaitable[object]) -> str:
    """Make a call of a past epoch; returns the text of its refusal.

    Raises:
        AssertionError: it was not refused, or without the code.
    """
    try:
        await call
    except StaleCommandError as error:
        assert error.code == "STALE_EPOCH", error.code
        return str(error)
    raise AssertionError("a command of a past epoch raises StaleCommandError")


def terminal(harness: ArbiterHarness, id_: str) -> list[BehaviorState]:
    """Return the reported terminal states of a behavior."""
    return [state for state in harness.states_of(id_) if state.terminal]


def link_is_up(harness: ArbiterHarness, vehicle: ResourceId) -> bool:
    """Whether the latest state of a vehicle says that its link is up."""
    state = harness.latest(vehicle)
    return state is not None and state.link is not LinkState.LOST


def speed(harness: ArbiterHarness, vehicle: ResourceId) -> float:
    """Return the latest speed of a vehicle, in m/s."""
    state = harness.latest(vehicle)
    if not isinstance(state, VehicleState) or state.velocity_enu_m_s is None:
        return 0.0
    return math.hypot(*state.velocity_enu_m_s)


def is_at_rest(harness: ArbiterHarness, case: ArbiterCase) -> bool:
    """Whether the vehicle is at rest."""
    return speed(harness, case.vehicle) < case.standing_m_s


def is_moving(harness: ArbiterHarness, case: ArbiterCase) -> bool:
    """Whether the vehicle clearly moves."""
    return speed(harness, case.vehicle) > 2 * case.standing_m_s
