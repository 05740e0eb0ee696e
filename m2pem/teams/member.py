"""One member of a team behavior: its part, and the calls to its arbiter."""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable

from m2pem.api.arbiter import Arbiter, BehaviorReport, BehaviorRequest, adjusts, sights
from m2pem.errors import StaleCommandError
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.teams.plan import Leg

CALL_TIMEOUT_S = 10.0
"""As the dispatcher's: an arbiter only sends a command; one that hangs is faulty."""

TURN_TIMEOUT_S = 8.0
"""Of a hold or resume by the run: the team must fail before the dispatcher's own timeout."""

MAY_SEND_EVERY_S = 0.05

SPEED_STEP_SHARE = 0.05
"""Share of the last commanded speed: smaller changes are not sent."""

_log = logging.getLogger("m2pem.teams")


class Member:
    """Sends the formation controller's commands one after the other. A hold and a resume by the
    run, and a cancel, are sent at once; a command of the controller that still waits is dropped.

    `part`: the id of its part, "" before and between parts. `state`: the part's last reported
    state; None: no report yet. `paused`: a run holds the member. `halted`: the controller holds it.
    `lost`: why the team goes on without it. `failed` is called with the reason when the arbiter's
    `start` raises or hangs, `superseded` with the newer epoch when it refuses a command because
    another executive drives the run. `may_send`: as in `ArbiterContext`; until it is true, a part
    does not begin, and the controller's commands are dropped.
    """

    def __init__(
        self,
        member: ResourceId,
        arbiter: Arbiter,
        failed: Callable[[ResourceId, str], None],
        superseded: Callable[[int], None],
        may_send: Callable[[], bool],
    ) -> None:
        self.id = member
        self.limits = arbiter.limits(member)
        self.part = ""
        self.state: BehaviorState | None = None
        self.native_ref: str | None = None
        self.begun_us = 0
        self.paused = False
        self.halted = False
        self.lost = ""
        self._arbiter = arbiter
        self._failed = failed
        self._superseded = superseded
        self._may_send = may_send
        self._sighted = sights(arbiter)
        self._adjusting = arbiter if adjusts(arbiter) else None
        self._speed_m_s: float | None = None
        self._cancelled = ""
        self._starting: asyncio.Task[None] | None = None
        self._tail: asyncio.Task[None] | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def adjustable(self) -> bool:
        """Whether its speed can be changed while its part is running."""
        return self._adjusting is not None

    @property
    def publishes_position(self) -> bool:
        """Whether its telemetry has its position regularly."""
        return math.isfinite(self.limits.lost_after_s)

    @property
    def in_sight(self) -> bool:
        """Whether its position is always known, so that it can keep its place in a formation."""
        return self._sighted or self.publishes_position

    @property
    def active(self) -> bool:
        """Whether its part has not ended, as far as known."""
        return bool(self.part) and (self.state is None or not self.state.terminal)

    @property
    def goes(self) -> bool:
        """Whether its part was reported RUNNING and has not ended."""
        return self.active and self.state is BehaviorState.RUNNING

    def begin(
        self, part: str, leg: Leg, epoch: int, preempts: tuple[str, ...], now_us: int
    ) -> None:
        self.part, self.state, self.native_ref, self.begun_us = part, None, None, now_us
        self.halted = False
        speed = leg.parameters.get("speed")
        self._speed_m_s = float(speed) if isinstance(speed, int | float) else None
        request = BehaviorRequest(
            part, epoch, leg.behavior, leg.parameters, (self.id,), {"member": (self.id,)}, preempts
        )

        async def start() -> None:
            try:
                async with asyncio.timeout(CALL_TIMEOUT_S):
                    while not self._may_send():  # noqa: ASYNC110  # the journal answers soon
                        await asyncio.sleep(MAY_SEND_EVERY_S)
                    await self._arbiter.start(request)
            except StaleCommandError as error:
                self._superseded(error.newest)
                return
            except TimeoutError:
                self._failed(self.id, f"its arbiter did not return within {CALL_TIMEOUT_S:g} s")
            except Exception as error:  # an arbiter's fault is the member's, not the team's
                _log.exception("start %s: the arbiter raised", part)
                self._failed(self.id, f"its arbiter raised {type(error).__name__}: {error}")
            if self.paused:  # the run has held it meanwhile, which the start may have undone
                await self._call(f"hold {self.id}", self._arbiter.hold(self.id))

        self._starting = self._enqueue(start)

    def adopt(self, part: str, report: BehaviorReport, native_ref: str | None) -> None:
        """Adopt a part that its arbiter knows after a restart, running or ended."""
        self.part, self.state = part, report.state
        self.native_ref = report.native_ref or native_ref

    def let_go(self) -> None:
        """Resume its part after a restart, when an operator has decided to go on."""
        self.halted = False
        if self.active:
            self._enqueue(self._go_on)

    def cancel(self, epoch: int) -> None:
        part = self.part
        if self.active and self._cancelled != part:
            self._cancelled = part
            starting = self._starting  # an arbiter cannot end what it has not begun
            self._task(
                lambda: self._call(f"cancel {part}", self._arbiter.cancel(part, epoch)), starting
            )

    def go(self, speed_m_s: float, epoch: int) -> None:
        """Command a speed, or (0) a halt; skipped while an earlier command still waits."""
        if not self._may_send():
            return
        if self.paused or not self.goes or (self._tail is not None and not self._tail.done()):
            return
        if speed_m_s == 0.0:
            if not self.halted:
                self.halted = True
                self._enqueue(self._halt)
            return
        if self.adjustable and self._worth(speed_m_s):
            self._enqueue(lambda: self._adjust(speed_m_s, epoch))
        if self.halted:
            self.halted = False
            self._enqueue(self._go_on)

    async def hold(self) -> str:
        """Hold it for a run. Return "", or why it is not held."""
        self.paused = True
        return await self._turn(f"hold {self.id}", self._arbiter.hold(self.id))

    async def resume(self) -> str:
        """Resume it for a run, unless the controller halts it. Return as `hold` does."""
        self.paused = False
        if self.halted:
            return ""
        return await self._turn(f"resume {self.id}", self._arbiter.resume(self.id))

    def close(self) -> None:
        """Command nothing more."""
        for task in self._tasks:
            task.cancel()

    # --- inside ---------------------------------------------------------------------------------

    def _worth(self, speed_m_s: float) -> bool:
        last = self._speed_m_s
        return last is None or abs(speed_m_s - last) > SPEED_STEP_SHARE * last

    async def _adjust(self, speed_m_s: float, epoch: int) -> None:
        if self._adjusting is not None and self._obeys:
            self._speed_m_s = speed_m_s
            part, arbiter = self.part, self._adjusting

            async def adjust() -> None:
                answer = await arbiter.adjust(part, epoch, {"speed": speed_m_s})
                if answer is not None:
                    self._task(lambda: self._answered(answer), None)

            await self._call(f"adjust {part}", adjust())

    async def _answered(self, answer: Awaitable[str]) -> None:
        """Log that a speed was not taken. The next command does not wait for the answer."""
        if wrong := await answer:
            _log.warning("%s may keep its speed: %s", self.id, wrong, extra={"resource": self.id})

    @property
    def _obeys(self) -> bool:
        """Whether the controller may still command it."""
        return self.active and not self.paused and self._cancelled != self.part

    async def _halt(self) -> None:
        if self._obeys:
            await self._call(f"halt {self.id}", self._arbiter.hold(self.id))

    async def _go_on(self) -> None:
        if not self._obeys:
            return
        await self._call(f"go on {self.id}", self._arbiter.resume(self.id))
        if self.paused:  # a run has held it meanwhile, and the run has precedence
            await self._call(f"hold {self.id}", self._arbiter.hold(self.id))

    def _enqueue(self, job: Callable[[], Awaitable[None]]) -> asyncio.Task[None]:
        self._tail = self._task(job, self._tail)
        return self._tail

    def _task(
        self, job: Callable[[], Awaitable[None]], before: asyncio.Task[None] | None
    ) -> asyncio.Task[None]:
        async def in_turn() -> None:
            if before is not None and not before.done():
                await asyncio.wait([before])
            await job()

        task = asyncio.get_running_loop().create_task(in_turn())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _call(self, what: str, call: Awaitable[None]) -> None:
        await self._turn(what, call, CALL_TIMEOUT_S)

    async def _turn(
        self, what: str, call: Awaitable[None], timeout_s: float = TURN_TIMEOUT_S
    ) -> str:
        """Await an arbiter's call within its bound. Return "", or the fault."""
        try:
            async with asyncio.timeout(timeout_s):
                await call
        except StaleCommandError as error:
            _log.error("%s: %s", what, error)
            self._superseded(error.newest)
            return str(error)
        except TimeoutError:
            _log.error("%s: the arbiter did not return within %g s", what, timeout_s)
            return f"its arbiter did not return within {timeout_s:g} s"
        except Exception as error:  # an arbiter's fault must not end the team
            _log.exception("%s: the arbiter raised", what)
            return f"its arbiter raised {type(error).__name__}: {error}"
        return ""
