"""Commands that ask an executive and end."""

import asyncio
from pathlib import Path

import pytest

from m2pem.control_socket.client import ask, ask_driver, choose_executive, find_executive
from m2pem.control_socket.paths import ControlSocketError
from m2pem.errors import NotDrivenError, OperatorError
from tests.control_socket.conftest import Served


async def test_a_prompt_is_answered_and_who_did_is_journaled(served: Served) -> None:
    run, prompt = await served.asked()
    answer = {"prompt": prompt, "decision": "yes", "by": "anna@gcs1"}
    await asyncio.to_thread(ask_driver, served.journal, run, "answer", **answer)
    assert (await served.control.wait(run)).status == "completed"
    answered = [each.record for each in await served.control.records(run)]
    assert [each.by for each in answered if type(each).__name__ == "PromptAnswered"] == [
        "anna@gcs1"
    ]


async def test_a_refusal_is_the_operators_to_know(served: Served) -> None:
    run, _ = await served.asked()
    question = {"prompt": "r1.p9", "decision": "yes"}
    with pytest.raises(OperatorError, match="p9"):
        await asyncio.to_thread(ask_driver, served.journal, run, "answer", **question)


async def test_a_run_that_nobody_drives_is_told(served: Served) -> None:
    with pytest.raises(OperatorError, match="r9 is not driven"):
        await asyncio.to_thread(ask_driver, served.journal, "r9", "stop")
    with pytest.raises(NotDrivenError):
        await asyncio.to_thread(ask, served.path, "stop", run="r9")


def test_without_an_executive_the_journal_is_named(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match=r"no executive .*j\.db"):
        ask_driver(tmp_path / "j.db", "r1", "stop")


def test_a_socket_that_is_gone_is_told(tmp_path: Path) -> None:
    with pytest.raises(ControlSocketError, match="does not answer"):
        ask(tmp_path / "1.sock", "runs")


async def test_the_executive_of_a_journal_is_found(served: Served, tmp_path: Path) -> None:
    run, _ = await served.asked()
    for wanted in (None, run):
        assert await asyncio.to_thread(find_executive, served.journal, wanted) == served.path
    with pytest.raises(OperatorError, match="r9 is not driven"):
        await asyncio.to_thread(find_executive, served.journal, "r9")
    with pytest.raises(OperatorError, match="no executive"):
        find_executive(tmp_path / "other.db", None)


async def test_which_of_several_executives_is_asked(served: Served) -> None:
    run, _ = await served.asked()
    second = served.path.with_name("1.sock")
    second.symlink_to(served.path)
    with pytest.raises(OperatorError, match="2 executives"):
        await asyncio.to_thread(find_executive, served.journal, None)
    assert (await asyncio.to_thread(find_executive, served.journal, run)).exists()
    with pytest.raises(OperatorError, match=r"2 executives.*1 with fleet test.*--run-on 1"):
        await asyncio.to_thread(choose_executive, served.journal, None)
    with pytest.raises(OperatorError, match=r"no executive 'other'.*1 with fleet test"):
        await asyncio.to_thread(choose_executive, served.journal, "other")
    assert await asyncio.to_thread(choose_executive, served.journal, "1") == second


async def test_an_executive_is_chosen_by_its_fleet(served: Served, tmp_path: Path) -> None:
    for wanted in (None, "test", served.path.stem):
        chosen = await asyncio.to_thread(choose_executive, served.journal, wanted)
        assert chosen == served.path
    with pytest.raises(OperatorError, match="no executive with the journal"):
        choose_executive(tmp_path / "other.db", None)
