"""What every operator control unit must keep to, as tests to inherit."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import ClassVar

import pytest

from m2pem.api.control import RunStatus
from m2pem.errors import OperatorError
from m2pem.testing import scenarios
from m2pem.testing.contracts.contract import Contract, needs
from m2pem.testing.contracts.ocu_bench import MakeOcu, OcuBench, Operate, Operator, seated

__all__ = ["MakeOcu", "OcuContract", "Operate", "Operator"]

Main = Callable[[OcuBench], Awaitable[None]]

OTHER = "the other operator"


class OcuContract(Contract):
    """Override `make_ocu` and `operate`. Tests run an executive with simulated vehicles on a real
    clock, as a unit waits for real keys and sockets.

    Say in `unsupported` what the unit does not support, and why, by the subjects of `subjects`.
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
        """Makes a unit of a `MissionControl`, as the plugin registers it."""
        raise NotImplementedError("override the fixture `make_ocu`")

    @pytest.fixture
    def operate(self) -> Operate:
        """Makes the operator of a unit: who sees what it shows, and presses its keys."""
        raise NotImplementedError("override the fixture `operate`")

    @pytest.fixture
    def sit(self, make_ocu: MakeOcu, operate: Operate) -> Callable[[Main], None]:
        """Runs a test with a unit that serves, and its operator."""

        def run(main: Main) -> None:
            asyncio.run(seated(make_ocu, operate, main))

        return run

    # --- showing --------------------------------------------------------------------------------

    def test_shows_a_question_with_its_decisions(self, sit: Callable[[Main], None]) -> None:
        """Its text, and every label."""

        async def main(bench: OcuBench) -> None:
            await bench.asked(scenarios.question("Is the road clear?", ("proceed", "retreat")))
            for text in ("Is the road clear?", "proceed", "retreat"):
                await bench.shows(text)

        sit(main)

    def test_shows_a_question_that_stood_before_it_began(
        self, make_ocu: MakeOcu, operate: Operate
    ) -> None:
        """An operator who comes late must not miss it."""

        async def before(bench: OcuBench) -> None:
            await bench.asked(scenarios.question("Was it clear before?"))

        async def main(bench: OcuBench) -> None:
            await bench.shows("Was it clear before?")

        asyncio.run(seated(make_ocu, operate, main, before))

    def test_shows_several_questions_at_once(self, sit: Callable[[Main], None]) -> None:
        """Of one run and of another."""

        async def main(bench: OcuBench) -> None:
            await bench.asked(scenarios.two_questions("Road?", "Bridge?"))
            await bench.asked(scenarios.question("Tunnel?"))
            for text in ("Road?", "Bridge?", "Tunnel?"):
                await bench.shows(text)
            assert len(bench.control.prompts()) == 3, "nobody has answered any"

        sit(main)

    # --- answering ------------------------------------------------------------------------------

    @needs("answers")
    def test_an_answer_reaches_the_mission(self, sit: Callable[[Main], None]) -> None:
        """The run goes on with it, and the journal says who gave it."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question(decisions=("continue", "abort")))
            await bench.operator.answer(prompt, "abort")
            answered = await bench.answered(prompt)
            assert answered.decision == "abort"
            assert answered.by, "an answer says who gave it: answer(..., by=...)"
            assert await bench.ended(prompt.run) is RunStatus.COMPLETED

        sit(main)

    @needs("answers")
    def test_several_questions_are_answered_in_any_order(self, sit: Callable[[Main], None]) -> None:
        """Each answer belongs to its question."""

        async def main(bench: OcuBench) -> None:
            first, second = await bench.asked(
                scenarios.two_questions("Road?", "Bridge?", ("yes", "no"))
            )
            await bench.operator.answer(second, "no")
            assert (await bench.answered(second)).decision == "no"
            assert [prompt.prompt for prompt in bench.control.prompts()] == [first.prompt]
            await bench.operator.answer(first, "yes")
            assert (await bench.answered(first)).decision == "yes"

        sit(main)

    def test_is_told_that_another_operator_answered_first(
        self, sit: Callable[[Main], None]
    ) -> None:
        """It shows who it was."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question("Is the road clear?"))
            await bench.shows("Is the road clear?")
            await bench.control.answer(prompt.run, prompt.prompt, "continue", by=OTHER)
            await bench.shows(OTHER)

        sit(main)

    @needs("answers")
    def test_a_late_answer_does_no_harm(self, sit: Callable[[Main], None]) -> None:
        """The first one holds, and the next question can be answered here."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question("First?"))
            await bench.shows("First?")
            await bench.control.answer(prompt.run, prompt.prompt, "continue", by=OTHER)
            await bench.shows(OTHER)
            await bench.operator.answer(prompt, "abort")
            await bench.answers()
            assert (await bench.answered(prompt)).by == OTHER

        sit(main)

    @needs("answers", "unknown decision")
    def test_an_unknown_decision_is_not_an_answer(self, sit: Callable[[Main], None]) -> None:
        """The question stands, and can still be answered."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question(decisions=("continue", "abort")))
            await bench.operator.answer(prompt, "no-such-decision")
            await bench.goes_on()
            assert [each.prompt for each in bench.control.prompts()] == [prompt.prompt]
            await bench.operator.answer(prompt, "abort")
            assert (await bench.answered(prompt)).decision == "abort"

        sit(main)

    @needs("answers", "another unit")
    def test_of_two_units_the_first_answer_wins(self, sit: Callable[[Main], None]) -> None:
        """Both ask, one answers, and the other goes on."""

        async def main(bench: OcuBench) -> None:
            async with bench.another() as other:
                (prompt,) = await bench.asked(scenarios.question("Road?", ("yes", "no")))
                await bench.shows("Road?")
                await other.shows("Road?")
                await other.operator.answer(prompt, "no")
                assert (await bench.answered(prompt)).decision == "no"
                await bench.operator.answer(prompt, "yes")
                await bench.answers()
                await other.answers()

        sit(main)

    # --- steering -------------------------------------------------------------------------------

    @needs("stop")
    def test_an_operator_stops_a_run_that_moves_a_vehicle(
        self, sit: Callable[[Main], None]
    ) -> None:
        """Everything of it ends, and its vehicle is released."""

        async def main(bench: OcuBench) -> None:
            run = await bench.moving()
            await bench.operator.stop(run)
            assert await bench.ended(run) is RunStatus.STOPPED

        sit(main)

    @needs("stop")
    def test_an_operator_stops_a_run_that_asks(self, sit: Callable[[Main], None]) -> None:
        """Over an open question, which is then withdrawn."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question("Road?"))
            await bench.shows("Road?")
            await bench.operator.stop(prompt.run)
            assert await bench.ended(prompt.run) is RunStatus.STOPPED
            assert bench.control.prompts() == []
            await bench.goes_on()

        sit(main)

    # --- what goes wrong ------------------------------------------------------------------------

    def test_goes_on_when_a_question_is_withdrawn(self, sit: Callable[[Main], None]) -> None:
        """Its run was stopped by someone else."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question("Road?"))
            await bench.shows("Road?")
            await bench.control.stop(prompt.run, by=OTHER)
            await bench.ended(prompt.run)
            await bench.goes_on()

        sit(main)

    @needs("answers")
    def test_goes_on_when_a_call_is_refused(self, sit: Callable[[Main], None]) -> None:
        """`OperatorError` is for the operator to read."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question("Road?"))
            bench.faults.refuse("answer", OperatorError("refused, says the test"))
            await bench.operator.answer(prompt, "continue")
            await bench.shows("refused, says the test")
            bench.faults.mend()
            await bench.operator.answer(prompt, "continue")
            await bench.answered(prompt)

        sit(main)

    @needs("answers")
    def test_goes_on_showing_while_a_call_takes_long(self, sit: Callable[[Main], None]) -> None:
        """A commit may wait for a disk, and a link for a radio."""

        async def main(bench: OcuBench) -> None:
            (prompt,) = await bench.asked(scenarios.question("Road?"))
            bench.faults.hang("answer")
            await bench.operator.answer(prompt, "continue")
            await bench.faults.called("answer")
            await bench.asked(scenarios.question("Shown meanwhile?"))
            await bench.shows("Shown meanwhile?")
            bench.faults.mend()
            await bench.answered(prompt)

        sit(main)

    @needs("answers", "stop")
    def test_stop_works_while_another_call_takes_long(self, sit: Callable[[Main], None]) -> None:
        """STOP waits for nothing."""

        async def main(bench: OcuBench) -> None:
            run = await bench.moving()
            (prompt,) = await bench.asked(scenarios.question("Road?"))
            bench.faults.hang("answer")
            await bench.operator.answer(prompt, "continue")
            await bench.faults.called("answer")
            await bench.operator.stop(run)
            assert await bench.ended(run) is RunStatus.STOPPED

        sit(main)

    # --- its end --------------------------------------------------------------------------------

    def test_ends_when_it_is_cancelled_and_leaves_no_task(
        self, sit: Callable[[Main], None]
    ) -> None:
        """With a question open."""

        async def main(bench: OcuBench) -> None:
            await bench.asked(scenarios.question("Road?"))
            await bench.shows("Road?")
            await bench.leave()
            assert not bench.unfinished, f"tasks go on after it was cancelled: {bench.unfinished}"

        sit(main)

    def test_bears_the_end_of_the_executive(self, sit: Callable[[Main], None]) -> None:
        """It ends, or waits to be cancelled; it does not break."""

        async def main(bench: OcuBench) -> None:
            await bench.asked(scenarios.question("Road?"))
            await bench.shows("Road?")
            await bench.end_executive()
            await bench.takes_notice()
            await bench.leave()

        sit(main)
