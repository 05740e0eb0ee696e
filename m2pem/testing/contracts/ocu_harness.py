"""The harness of OCU tests: an executive, faults on request, and the operator of the unit."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from contextvars import ContextVar, copy_context
from typing import Any, Protocol

from m2pem.api.control import MissionControl
from m2pem.api.ocu import Ocu
from m2pem.api.runs import OpenPrompt, RunId, RunStatus
from m2pem.engine.records import BehaviorProgressed, PromptAnswered
from m2pem.mission.catalogue import BehaviorState
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive

WITHIN_S = 10.0
POLL_S = 0.01
LOOP_ITERATIONS = 100
SPEED = 20.0
VEHICLE = "ugv1"


_MAKER: ContextVar[set[asyncio.Task[Any]] | None] = ContextVar("_MAKER", default=None)


class Operator(Protocol):
    """The operator of a unit, who reads its screen and presses its keys."""

    def screen(self) -> str:
        """Return all text that the unit shows or has shown."""
        ...

    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        """Answer a question at the unit; returns when the keys are pressed, not when it is
        decided."""
        ...

    async def stop(self, run: RunId) -> None:
        """Stop a run at the unit."""
        ...


MakeOcu = Callable[[MissionControl], Ocu]
Operate = Callable[[Ocu], Operator]


class Faults:
    """A proxy of `MissionControl` for a unit: calls can be refused, or hang."""

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._refused: dict[str, Exception] = {}
        self._hanging: set[str] = set()
        self._calls: list[str] = []
        self._mended = asyncio.Event()

    def refuse(self, method: str, error: Exception) -> None:
        """Make calls of a method raise an error."""
        self._refused[method] = error

    def hang(self, method: str) -> None:
        """Make calls of a method wait until `mend`."""
        self._mended.clear()
        self._hanging.add(method)

    def mend(self) -> None:
        """Let all blocked calls return."""
        self._refused.clear()
        self._hanging.clear()
        self._mended.set()

    async def called(self, method: str) -> None:
        """Wait until a method that is refused or hangs was called."""
        called = await until(lambda: method in self._calls)
        assert called, f"the unit did not call {method}"

    def __getattr__(self, name: str) -> Any:
        if name in self._refused or name in self._hanging:
            return lambda *args, **options: self._faulty(name, *args, **options)
        return getattr(self._control, name)

    async def _faulty(self, name: str, *args: Any, **options: Any) -> Any:
        self._calls.append(name)
        if name in self._refused:
            raise self._refused[name]
        await self._mended.wait()
        return await getattr(self._control, name)(*args, **options)


class OcuHarness:
    """A serving unit, its operator, and the executive, which is reached without the faults."""

    def __init__(
        self,
        control: MissionControl,
        make_ocu: MakeOcu,
        operate: Operate,
        end_executive: Callable[[], Awaitable[None]],
    ) -> None:
        self.control = control
        self.end_executive = end_executive
        self.faults = Faults(control)
        self._make_ocu = make_ocu
        self._operate = operate
        self._questions = 0
        self._serving: asyncio.Task[None]
        self.operator: Operator

    def begin(self) -> None:
        """Start the unit's `serve`."""
        tasks = self._tasks = _watch_tasks()
        context = copy_context()
        context.run(_MAKER.set, tasks)
        ocu = context.run(self._make_ocu, self.faults)
        self.operator = self._operate(ocu)
        self._serving = asyncio.create_task(ocu.serve(), name="the unit", context=context)

    @property
    def unfinished(self) -> list[asyncio.Task[Any]]:
        """The tasks that the unit made, and those that they made, which have not ended."""
        return [task for task in self._tasks if not task.done()]

    async def takes_notice(self) -> None:
        """Let every task of the event loop continue: a unit that breaks does so here."""
        for _ in range(LOOP_ITERATIONS):
            await asyncio.sleep(0)

    async def leave(self) -> None:
        """Cancel the unit and wait for its end; an error of the unit is raised."""
        self._serving.cancel()
        done, _ = await asyncio.wait([self._serving], timeout=WITHIN_S)
        assert done, f"the unit goes on {WITHIN_S:g} s after it was cancelled"
        self._raise_what_broke_it()

    def _raise_what_broke_it(self) -> None:
        if self._serving.done() and not self._serving.cancelled():
            error = self._serving.exception()
            assert error is None, f"the unit broke: {error!r}"

    @asynccontextmanager
    async def another(self) -> AsyncIterator["OcuHarness"]:
        """A second unit at the same executive."""
        other = OcuHarness(self.control, self._make_ocu, self._operate, self.end_executive)
        other.begin()
        try:
            yield other
        finally:
            await other.leave()

    # --- missions -------------------------------------------------------------------------------

    async def asked(self, mission: bytes) -> Sequence[OpenPrompt]:
        """Start a mission, and wait for its questions; those of this run, in order."""
        run = await self.control.start(mission, by="test")
        expected = mission.count(b"<userTask")
        open_ = await until(lambda: len(self._open(run)) == expected)
        assert open_, f"{run} asks {self._open(run)}"
        return self._open(run)

    async def moving(self) -> RunId:
        """Start a mission that moves a vehicle for long; returns when it moves."""
        north = f"[{scenarios.ORIGIN[0] + 0.1}, {scenarios.ORIGIN[1]}]"
        run = await self.control.start(
            scenarios.one_behavior("goto", VEHICLE, target=north), by="test"
        )
        records = await self._recorded(
            run, lambda r: isinstance(r, BehaviorProgressed) and r.state is BehaviorState.RUNNING
        )
        assert records, "the simulated vehicle does not move"
        return run

    async def answered(self, prompt: OpenPrompt) -> PromptAnswered:
        """Wait until a question is answered; what the journal says of it."""
        found = await self._recorded(
            prompt.run, lambda r: isinstance(r, PromptAnswered) and r.prompt == prompt.prompt
        )
        assert found, f"{prompt.prompt} of {prompt.run} was not answered within {WITHIN_S:g} s"
        (answer,) = found
        return answer  # type: ignore[no-any-return]

    async def ended(self, run: RunId) -> RunStatus:
        """Wait until a run has ended and its vehicles are released; how it ended."""
        waiting = asyncio.create_task(self.control.wait(run))
        await asyncio.wait([waiting], timeout=WITHIN_S)
        if not waiting.done():
            waiting.cancel()
            raise AssertionError(f"{run} had not ended after {WITHIN_S:g} s")
        return waiting.result().status

    # --- the unit -------------------------------------------------------------------------------

    async def shows(self, text: str) -> None:
        """Wait until the unit shows a text, however it breaks the lines."""
        wanted = " ".join(text.split())
        shown = await until(
            lambda: wanted in " ".join(self.operator.screen().split()) or self._serving.done()
        )
        self._raise_what_broke_it()
        assert shown, f"it does not show {text!r}; it shows:\n{self.operator.screen()}"
        assert wanted in " ".join(self.operator.screen().split()), "the unit has left"

    async def goes_on(self) -> None:
        """Open a new prompt, and check that the unit shows it."""
        self._questions += 1
        text = f"Still there, {self._questions}?"
        (prompt,) = await self.asked(scenarios.question(text))
        await self.shows(text)
        await self.control.answer(prompt.run, prompt.prompt, "continue", by="test")

    async def answers(self) -> None:
        """Open a new prompt, and answer it at the unit."""
        self._questions += 1
        text = f"And now, {self._questions}?"
        (prompt,) = await self.asked(scenarios.question(text))
        await self.shows(text)
        await self.operator.answer(prompt, "continue")
        await self.answered(prompt)

    def _open(self, run: RunId) -> list[OpenPrompt]:
        return [prompt for prompt in self.control.prompts() if prompt.run == run]

    async def _recorded(self, run: RunId, wanted: Callable[[Any], bool]) -> list[Any]:
        deadline = asyncio.get_running_loop().time() + WITHIN_S
        while True:
            found = [
                stamped.record
                for stamped in await self.control.records(run)
                if wanted(stamped.record)
            ]
            if found or asyncio.get_running_loop().time() > deadline:
                return found
            await asyncio.sleep(POLL_S)


def _watch_tasks() -> set[asyncio.Task[Any]]:
    """Return a set that gets every task made in a context that has it as `_MAKER`."""

    def make(loop: asyncio.AbstractEventLoop, coro: Any, **options: Any) -> asyncio.Task[Any]:
        task: asyncio.Task[Any] = asyncio.Task(coro, loop=loop, **options)
        if (makers := _MAKER.get()) is not None:
            makers.add(task)
        return task

    asyncio.get_running_loop().set_task_factory(make)
    return set()


async def until(true: Callable[[], bool]) -> bool:
    """Wait until `true` returns true; False: it did not within `WITHIN_S`.

    A unit does not notify that its screen has changed, so the screen is polled.
    """
    deadline = asyncio.get_running_loop().time() + WITHIN_S
    while not true():
        if asyncio.get_running_loop().time() > deadline:
            return False
        await asyncio.sleep(POLL_S)
    return True


async def run_with_ocu(
    make_ocu: MakeOcu,
    operate: Operate,
    main: Callable[[OcuHarness], Awaitable[None]],
    before: Callable[[OcuHarness], Awaitable[None]] | None = None,
) -> None:
    """Run `main` with a serving unit; `before` runs before the unit is made."""
    fleet = scenarios.fleet("sim", {VEHICLE: {}})
    async with AsyncExitStack() as stack:
        control = await stack.enter_async_context(run_executive(fleet, speed=SPEED))
        harness = OcuHarness(control, make_ocu, operate, stack.aclose)
        if before is not None:
            await before(harness)
        harness.begin()
        try:
            await main(harness)
        finally:
            harness.faults.mend()
            await harness.leave()
