"""The contract of operator control units (OCUs), as tests to inherit."""

import asyncio
import functools
from collections.abc import Awaitable, Callable, Mapping
from typing import ClassVar

import pytest

from m2pem.api.runs import RunStatus
from m2pem.errors import OperatorError
from m2pem.testing import scenarios
from m2pem.testing.contracts.contract import Contract, needs, takes
from m2pem.testing.contracts.ocu_harness import MakeOcu, OcuHarness, Operate, Operator, run_with_ocu

__all__ = ["MakeOcu", "OcuContract", "Operate", "Operator"]

OTHER = "the other operator"


def served(test: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """Make a test of a coroutine method, which gets a serving unit and its operator."""

    @functools.wraps(test)
    def run_test(self: object, make_ocu: MakeOcu, operate: Operate) -> None:
        asyncio.run(run_with_ocu(make_ocu, operate, functools.partial(test, self)))

    return takes(run_test, "make_ocu", "operate")


class OcuContract(Contract):
    """Override `make_ocu` and `operate`. The tests run an executive with simulated vehicles on a
    real clock, because a unit waits for real keys and sockets.

    Declare in `unsupported` what the unit does not support, with the reason, by the subjects of
    `subjects`.
    """

    m2pem_contract: ClassVar[str] = "OcuContract"
    subjects: ClassVar[Mapping[str, str]] = {
        "answers": "an operator can answer questions here; if not, the unit only shows them",
        "another unit": "the factory can make two units that serve at once",
        "stop": "an operator can stop a run here",
        "unknown decision": "an operator could give an answer that is not among the decisions",
    }

    @pytest.fixture
    def make_ocu(self) -> MakeOcu:
        """A function that makes a unit of a `MissionControl`, as the plugin registers it."""
        raise NotImplementedError("override the fixture `make_ocu`")

    @pytest.fixture
    def operate(self) -> Operate:
        """A function that makes the operator of a unit, who reads its screen and presses its
        keys."""
        raise NotImplementedError("override the fixture `operate`")

    # --- showing --------------------------------------------------------------------------------

    @served
    async def test_shows_a_question_with_its_decisions(self, harness: OcuHarness) -> None:
        """Its text, and every label."""
        await harness.asked(scenarios.question("Is the road clear?", ("proceed", "retreat")))
        for text in ("Is the road clear?", "proceed", "retreat"):
            await harness.shows(text)

    def test_shows_a_question_that_was_open_before_it_began(
        self, make_ocu: MakeOcu, operate: Operate
    ) -> None:
        """An operator who comes late must not miss it."""

        async def before(harness: OcuHarness) -> None:
            await harness.asked(scenarios.question("Was it clear before?"))

        async def main(harness: OcuHarness) -> None:
            await harness.shows("Was it clear before?")

        asyncio.run(run_with_ocu(make_ocu, operate, main, before))

    @served
    async def test_shows_several_questions_at_once(self, harness: OcuHarness) -> None:
        """Prompts of two runs are shown at once."""
        await harness.asked(scenarios.two_questions("Road?", "Bridge?"))
        await harness.asked(scenarios.question("Tunnel?"))
        for text in ("Road?", "Bridge?", "Tunnel?"):
            await harness.shows(text)
        assert len(harness.control.prompts()) == 3, "no question was answered"

    # --- answering ------------------------------------------------------------------------------

    @needs("answers")
    @served
    async def test_an_answer_reaches_the_mission(self, harness: OcuHarness) -> None:
        """The run goes on with it, and the journal says who gave it."""
        (prompt,) = await harness.asked(scenarios.question(decisions=("continue", "abort")))
        await harness.operator.answer(prompt, "abort")
        answered = await harness.answered(prompt)
        assert answered.decision == "abort"
        assert answered.by, "an answer says who gave it: answer(..., by=...)"
        assert await harness.ended(prompt.run) is RunStatus.COMPLETED

    @needs("answers")
    @served
    async def test_several_questions_are_answered_in_any_order(self, harness: OcuHarness) -> None:
        """Each answer belongs to its question."""
        first, second = await harness.asked(
            scenarios.two_questions("Road?", "Bridge?", ("yes", "no"))
        )
        await harness.operator.answer(second, "no")
        assert (await harness.answered(second)).decision == "no"
        assert [prompt.prompt for prompt in harness.control.prompts()] == [first.prompt]
        await harness.operator.answer(first, "yes")
        assert (await harness.answered(first)).decision == "yes"

    @served
    async def test_shows_that_another_operator_answered_first(self, harness: OcuHarness) -> None:
        """The unit shows the name of the other operator."""
        (prompt,) = await harness.asked(scenarios.question("Is the road clear?"))
        await harness.shows("Is the road clear?")
        await harness.control.answer(prompt.run, prompt.prompt, "continue", by=OTHER)
        await harness.shows(OTHER)

    @needs("answers")
    @served
    async def test_a_late_answer_does_no_harm(self, harness: OcuHarness) -> None:
        """The first one holds, and the next question can be answered here."""
        (prompt,) = await harness.asked(scenarios.question("First?"))
        await harness.shows("First?")
        await harness.control.answer(prompt.run, prompt.prompt, "continue", by=OTHER)
        await harness.shows(OTHER)
        await harness.operator.answer(prompt, "abort")
        await harness.answers()
        assert (await harness.answered(prompt)).by == OTHER

    @needs("answers", "unknown decision")
    @served
    async def test_an_unknown_decision_is_not_an_answer(self, harness: OcuHarness) -> None:
        """The question is still open, and can be answered."""
        (prompt,) = await harness.asked(scenarios.question(decisions=("continue", "abort")))
        await harness.operator.answer(prompt, "no-such-decision")
        await harness.goes_on()
        assert [each.prompt for each in harness.control.prompts()] == [prompt.prompt]
        await harness.operator.answer(prompt, "abort")
        assert (await harness.answered(prompt)).decision == "abort"

    @needs("answers", "another unit")
    @served
    async def test_of_two_units_the_first_answer_wins(self, harness: OcuHarness) -> None:
        """Both ask, one answers, and the other goes on."""
        async with harness.another() as other:
            (prompt,) = await harness.asked(scenarios.question("Road?", ("yes", "no")))
            await harness.shows("Road?")
            await other.shows("Road?")
            await other.operator.answer(prompt, "no")
            assert (await harness.answered(prompt)).decision == "no"
            await harness.operator.answer(prompt, "yes")
            await harness.answers()
            await other.answers()

    # --- steering -------------------------------------------------------------------------------

    @needs("stop")
    @served
    async def test_an_operator_stops_a_run_that_moves_a_vehicle(self, harness: OcuHarness) -> None:
        """Everything of it ends, and its vehicle is released."""
        run = await harness.moving()
        await harness.operator.stop(run)
        assert await harness.ended(run) is RunStatus.STOPPED

    @needs("stop")
    @served
    async def test_an_operator_stops_a_run_that_asks(self, harness: OcuHarness) -> None:
        """Over an open question, which is then withdrawn."""
        (prompt,) = await harness.asked(scenarios.question("Road?"))
        await harness.shows("Road?")
        await harness.operator.stop(prompt.run)
        assert await harness.ended(prompt.run) is RunStatus.STOPPED
        assert harness.control.prompts() == []
        await harness.goes_on()

    # --- what goes wrong ------------------------------------------------------------------------

    @served
    async def test_goes_on_when_a_question_is_withdrawn(self, harness: OcuHarness) -> None:
        """Its run was stopped by someone else."""
        (prompt,) = await harness.asked(scenarios.question("Road?"))
        await harness.shows("Road?")
        await harness.control.stop(prompt.run, by=OTHER)
        await harness.ended(prompt.run)
        await harness.goes_on()

    @needs("answers")
    @served
    async def test_goes_on_when_a_call_is_refused(self, harness: OcuHarness) -> None:
        """`OperatorError` is for the operator to read."""
        (prompt,) = await harness.asked(scenarios.question("Road?"))
        harness.faults.refuse("answer", OperatorError("refused, says the test"))
        await harness.operator.answer(prompt, "continue")
        await harness.shows("refused, says the test")
        harness.faults.mend()
        await harness.operator.answer(prompt, "continue")
        await harness.answered(prompt)

    @needs("answers")
    @served
    async def test_goes_on_showing_while_a_call_takes_long(self, harness: OcuHarness) -> None:
        """A commit may wait for a disk, and a link for a radio."""
        (prompt,) = await harness.asked(scenarios.question("Road?"))
        harness.faults.hang("answer")
        await harness.operator.answer(prompt, "continue")
        await harness.faults.called("answer")
        await harness.asked(scenarios.question("Shown meanwhile?"))
        await harness.shows("Shown meanwhile?")
        harness.faults.mend()
        await harness.answered(prompt)

    @needs("answers", "stop")
    @served
    async def test_stop_works_while_another_call_takes_long(self, harness: OcuHarness) -> None:
        """STOP does not wait for another call."""
        run = await harness.moving()
        (prompt,) = await harness.asked(scenarios.question("Road?"))
        harness.faults.hang("answer")
        await harness.operator.answer(prompt, "continue")
        await harness.faults.called("answer")
        await harness.operator.stop(run)
        assert await harness.ended(run) is RunStatus.STOPPED

    # --- its end --------------------------------------------------------------------------------

    @served
    async def test_ends_when_it_is_cancelled_and_leaves_no_task(self, harness: OcuHarness) -> None:
        """The unit ends while a prompt is open."""
        await harness.asked(scenarios.question("Road?"))
        await harness.shows("Road?")
        await harness.leave()
        assert not harness.unfinished, f"tasks go on after it was cancelled: {harness.unfinished}"

    @served
    async def test_bears_the_end_of_the_executive(self, harness: OcuHarness) -> None:
        """The unit ends, or waits to be cancelled; it raises nothing."""
        await harness.asked(scenarios.question("Road?"))
        await harness.shows("Road?")
        await harness.end_executive()
        await harness.takes_notice()
        await harness.leave()
