"""A seat for a unit under test: a real executive, faults on request, and its operator."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from contextvars import ContextVar, copy_context
from typing import Any, Protocol

from m2pem.api.control import MissionControl, OpenPrompt, RunId, RunStatus
from m2pem.api.ocu import Ocu
from m2pem.engine.records import BehaviorProgressed, PromptAnswered
from m2pem.mission.catalogue import BehaviorState
from m2pem.testing import scenarios
from m2pem.testing.stage import stage

WITHIN_S = 10.0
LOOK_EVERY_S = 0.01
TURNS = 100
SPEED = 20.0
VEHICLE = "ugv1"


_MAKER: ContextVar[set[asyncio.Task[Any]] | None] = ContextVar("_MAKER", default=None)


class Operator(Protocol):
    """Who sits at a unit: sees what it shows, and presses its keys."""

    def screen(self) -> str:
        """All that the unit shows now or has shown, as text."""
        ...

    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        """Do what answers a question here; returns when it is done, not when it is decided."""
        ...

    async def stop(self, run: RunId) -> None:
        """Do what stops a run here."""
        ...


MakeOcu = Callable[[MissionControl], Ocu]
Operate = Callable[[Ocu], Operator]


class Faults:
    """Stands between a unit and `MissionControl`: what is called can be refused, or hang."""

    def __init__(self, control: MissionControl) -> None:
        self._control = control
        self._refused: dict[str, Exception] = {}
        self._hanging: set[str] = set()
        self._calls: list[str] = []
        self._mended = asyncio.Event()

    def refuse(self, method: str, error: Exception) -> None:
        """Have calls of a method raise."""
        self._refused[method] = error

    def hang(self, method: str) -> None:
        """Have calls of a method wait until `mend`."""
        self._mended.clear()
        self._hanging.add(method)

    def mend(self) -> None:
        """Let all calls through."""
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


class OcuBench:
    """A unit that serves, its operator, and the executive behind it, past all faults."""

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
        """Have the unit serve."""
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
        """Wait until every task that can go on has gone on: a unit that breaks breaks here."""
        for _ in range(TURNS):
            await asyncio.sleep(0)

    async def leave(self) -> None:
        """Cancel the unit, and see it end; what broke it is raised."""
        self._serving.cancel()
        done, _ = await asyncio.wait([self._serving], timeout=WITHIN_S)
        assert done, f"the unit goes on {WITHIN_S:g} s after it was cancelled"
        self._raise_what_broke_it()

    def _raise_what_broke_it(self) -> None:
        if self._serving.done() and not self._serving.cancelled():
            error = self._serving.exception()
            assert error is None, f"the unit broke: {error!r}"

    @asynccontextmanager
    async def another(self) -> AsyncIterator["OcuBench"]:
        """A second unit at the same executive."""
        other = OcuBench(self.control, self._make_ocu, self._operate, self.end_executive)
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
        """Ask something new, and see it shown."""
        self._questions += 1
        text = f"Still there, {self._questions}?"
        (prompt,) = await self.asked(scenarios.question(text))
        await self.shows(text)
        await self.control.answer(prompt.run, prompt.prompt, "continue", by="test")

    async def answers(self) -> None:
        """Ask something new, and have it answered at the unit."""
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
            await asyncio.sleep(LOOK_EVERY_S)


def _watch_tasks() -> set[asyncio.Task[Any]]:
    """A set that gets every task which is made in a context that has it as `_MAKER`."""

    def make(loop: asyncio.AbstractEventLoop, coro: Any, **options: Any) -> asyncio.Task[Any]:
        task: asyncio.Task[Any] = asyncio.Task(coro, loop=loop, **options)
        if (makers := _MAKER.get()) is not None:
            makers.add(task)
        return task

    asyncio.get_running_loop().set_task_factory(make)
    return set()


async def until(true: Callable[[], bool]) -> bool:
    """Wait for something to become true; False if it is not within `WITHIN_S`.

    A unit tells nobody that its screen has changed, so that it is looked at again and again.
    """
    deadline = asyncio.get_running_loop().time() + WITHIN_S
    while not true():
        if asyncio.get_running_loop().time() > deadline:
            return False
        await asyncio.sleep(LOOK_EVERY_S)
    return True


async def seated(
    make_ocu: MakeOcu,
    operate: Operate,
    main: Callable[[OcuBench], Awaitable[None]],
    before: Callable[[OcuBench], Awaitable[None]] | None = None,
) -> None:
    """Run `main` with a unit that serves; `before` runs before the unit is made."""
    fleet = scenarios.fleet("sim", {VEHICLE: {}})
    async with AsyncExitStack() as stack:
        control = await stack.enter_async_context(stage(fleet, speed=SPEED))
        bench = OcuBench(control, make_ocu, operate, stack.aclose)
        if before is not None:
            await before(bench)
        bench.begin()
        try:
            await main(bench)
        finally:
            bench.faults.mend()
            await bench.leave()
