"""The contract must find what is wrong with a unit, or it proves nothing of a good one."""

import asyncio
import inspect
import types
from collections.abc import Callable

import pytest

from m2pem.api.control import MissionControl
from m2pem.api.runs import OpenPrompt, PromptClosed
from m2pem.errors import M2pemError
from m2pem.testing.contracts import ocu_harness
from m2pem.testing.contracts.ocu import OcuContract


class Panel:
    """A unit in memory, and its own operator."""

    def __init__(self, control: MissionControl) -> None:
        self.control = control
        self.shown: list[str] = []
        self.calls: asyncio.Queue[Callable[[], object]] = asyncio.Queue()

    async def serve(self) -> None:
        notices = self.control.subscribe()
        working = asyncio.create_task(self.work())
        try:
            async for notice in notices:
                if isinstance(notice, OpenPrompt):
                    self.ask(notice)
                elif isinstance(notice, PromptClosed):
                    self.closed(notice)
        finally:
            working.cancel()

    def ask(self, prompt: OpenPrompt) -> None:
        self.shown += [prompt.text, *(decision.label for decision in prompt.decisions)]

    def closed(self, notice: PromptClosed) -> None:
        self.shown.append(f"answered by {notice.by}" if notice.by else "withdrawn")

    async def work(self) -> None:
        async with asyncio.TaskGroup() as calls:
            while True:
                call = await self.calls.get()
                calls.create_task(self.tell(call))

    async def tell(self, call) -> None:
        try:
            await call()
        except M2pemError as error:
            self.refused(error)

    def refused(self, error: M2pemError) -> None:
        self.shown.append(str(error))

    def screen(self) -> str:
        return "\n".join(self.shown)

    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        self.calls.put_nowait(
            lambda: self.control.answer(prompt.run, prompt.prompt, decision, by="panel")
        )

    async def stop(self, run: str) -> None:
        self.calls.put_nowait(lambda: self.control.stop(run, by="panel"))


class Blind(Panel):
    def ask(self, prompt: OpenPrompt) -> None:
        pass


class Unlabelled(Panel):
    def ask(self, prompt: OpenPrompt) -> None:
        self.shown.append(prompt.text)


class OneAtATime(Panel):
    def ask(self, prompt: OpenPrompt) -> None:
        if not self.shown:
            super().ask(prompt)


class Late(Panel):
    """Knows nothing of what stood before it began."""

    async def serve(self) -> None:
        self.before = {prompt.prompt for prompt in self.control.prompts()}
        await super().serve()

    def ask(self, prompt: OpenPrompt) -> None:
        if prompt.prompt not in self.before:
            super().ask(prompt)


class Nameless(Panel):
    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        self.calls.put_nowait(lambda: self.control.answer(prompt.run, prompt.prompt, decision))


class AnswersTheFirst(Panel):
    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        await super().answer(self.control.prompts()[0], decision)


class Discreet(Panel):
    def closed(self, notice: PromptClosed) -> None:
        pass


class Brittle(Panel):
    async def tell(self, call) -> None:
        await call()


class Silent(Panel):
    def refused(self, error: M2pemError) -> None:
        pass


class Guesses(Panel):
    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        known = [each.value for each in prompt.decisions]
        await super().answer(prompt, decision if decision in known else known[0])


class NeverStops(Panel):
    async def stop(self, run: str) -> None:
        pass


class BreaksWhenWithdrawn(Panel):
    def closed(self, notice: PromptClosed) -> None:
        assert notice.by
        super().closed(notice)


class InTurn(Panel):
    async def work(self) -> None:
        while True:
            await self.tell(await self.calls.get())


class ShowsInTurn(Panel):
    """Waits for its call before it looks at what is new."""

    busy = False

    async def tell(self, call) -> None:
        self.busy = True
        await super().tell(call)
        self.busy = False

    def ask(self, prompt: OpenPrompt) -> None:
        if not self.busy:
            super().ask(prompt)


class Leaky(Panel):
    async def serve(self) -> None:
        self.left = asyncio.create_task(asyncio.sleep(60))
        await super().serve()


class Stubborn(Panel):
    async def serve(self) -> None:
        try:
            await super().serve()
        except asyncio.CancelledError:
            await asyncio.sleep(1)


class BreaksAtTheEnd(Panel):
    async def serve(self) -> None:
        await super().serve()
        raise RuntimeError("no more notices")


FINDS = [
    (Blind, "shows_a_question_with_its_decisions"),
    (Unlabelled, "shows_a_question_with_its_decisions"),
    (Late, "shows_a_question_that_was_open_before_it_began"),
    (OneAtATime, "shows_several_questions_at_once"),
    (Nameless, "an_answer_reaches_the_mission"),
    (AnswersTheFirst, "several_questions_are_answered_in_any_order"),
    (Discreet, "shows_that_another_operator_answered_first"),
    (Brittle, "a_late_answer_does_no_harm"),
    (Guesses, "an_unknown_decision_is_not_an_answer"),
    (Brittle, "of_two_units_the_first_answer_wins"),
    (NeverStops, "an_operator_stops_a_run_that_moves_a_vehicle"),
    (NeverStops, "an_operator_stops_a_run_that_asks"),
    (BreaksWhenWithdrawn, "goes_on_when_a_question_is_withdrawn"),
    (Silent, "goes_on_when_a_call_is_refused"),
    (ShowsInTurn, "goes_on_showing_while_a_call_takes_long"),
    (InTurn, "stop_works_while_another_call_takes_long"),
    (Leaky, "ends_when_it_is_cancelled_and_leaves_no_task"),
    (Stubborn, "ends_when_it_is_cancelled_and_leaves_no_task"),
    (BreaksAtTheEnd, "bears_the_end_of_the_executive"),
]
TESTS = {name.removeprefix("test_") for name in dir(OcuContract) if name.startswith("test_")}


def apply(unit: type[Panel], test: str) -> None:
    def operate(ocu: Panel) -> Panel:
        return ocu

    offered = {
        "make_ocu": unit,
        "operate": operate,
    }
    check: types.FunctionType = getattr(OcuContract, f"test_{test}")
    _, *wanted = inspect.signature(check).parameters
    check(OcuContract(), **{name: offered[name] for name in wanted})


@pytest.mark.parametrize("test", sorted(TESTS))
def test_the_contract_finds_nothing_wrong_with_a_good_unit(test: str) -> None:
    apply(Panel, test)


@pytest.mark.parametrize(
    ("unit", "test"), FINDS, ids=[f"{unit.__name__}-{test}" for unit, test in FINDS]
)
def test_the_contract_finds_what_is_wrong(
    unit: type[Panel], test: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ocu_harness, "WITHIN_S", 0.3)
    with pytest.raises(AssertionError):
        apply(unit, test)


def test_every_test_of_the_contract_is_shown_to_find_something() -> None:
    assert {test for _, test in FINDS} == TESTS
