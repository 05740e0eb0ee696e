"""Following runs: from the start, late, too slow, and after a loss."""

import asyncio
from collections.abc import AsyncIterator, Callable

import pytest

from m2pem.api import (
    ControlEvent,
    Listener,
    MissionControl,
    OpenPrompt,
    PromptClosed,
    RunStatus,
    RunView,
    StampedRecord,
    follow,
    follower,
)
from m2pem.errors import OperatorError
from m2pem.testing import scenarios
from m2pem.testing.harness import run_executive

FLEET = scenarios.fleet("sim", {"ugv1": {}})


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(20):
        while not condition():  # noqa: ASYNC110  # any event may change it
            await asyncio.sleep(0)


class Log(Listener):
    """A listener that keeps what it is called with."""

    def __init__(self) -> None:
        self.runs: list[str] = []
        self.new: list[tuple[str, int]] = []
        self.loaded: list[int] = []
        self.opened: list[str] = []
        self.closed: list[PromptClosed] = []
        self.statuses: list[RunStatus] = []

    def run_added(self, view: RunView) -> None:
        self.runs.append(view.run)

    def recorded(self, view: RunView, stamped: StampedRecord, *, is_new: bool) -> None:
        assert view.seq >= stamped.seq
        if is_new:
            self.new.append((stamped.run, stamped.seq))
        else:
            self.loaded.append(stamped.seq)

    def status_changed(self, view: RunView) -> None:
        self.statuses.append(view.status)

    def prompt_opened(self, prompt: OpenPrompt) -> None:
        self.opened.append(prompt.text)

    def prompt_closed(self, prompt: OpenPrompt, closed: PromptClosed) -> None:
        self.closed.append(closed)


async def test_every_record_of_a_run_is_reported_once() -> None:
    log = Log()
    async with run_executive(FLEET) as control:
        following = asyncio.create_task(follow(control, log).run())
        run = await control.start(scenarios.question("Road?"))
        await until(lambda: log.opened == ["Road?"])
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, "continue", by="anna")
        await control.wait(run)
        last = (await control.records(run))[-1].seq
        await until(lambda: len(log.new) >= last)
    await following
    assert log.new == [(run, seq) for seq in range(1, last + 1)]
    assert log.closed == [PromptClosed(run, prompt.prompt, "continue", "anna")]
    assert log.statuses == [RunStatus.RUNNING, RunStatus.COMPLETED]


async def test_records_between_subscription_and_loading_are_reported_as_new() -> None:
    log = Log()
    async with run_executive(FLEET) as control:
        made = follow(control, log)
        run = await control.start(scenarios.question("Road?"))
        last = (await control.records(run))[-1].seq
        following = asyncio.create_task(made.run())
        await until(lambda: len(log.new) >= last)
        assert log.loaded == [seq for _, seq in log.new] == list(range(1, last + 1))
        assert made.views[run].seq == last
        await control.stop(run)
    await following


async def test_a_late_follower_loads_what_was_before(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_executive(FLEET) as control:
        run = await control.start(scenarios.question("Road?"))
        await control.pause(run, by="bob")
        log = Log()
        view = await follow(control, log).load(run)
        assert view.status is RunStatus.PAUSED
        assert view.paused_by == "bob"
        assert [each.element for each in view.active()]
        assert log.runs == [run]
        assert log.new == []
        await control.stop(run)


async def test_a_follower_that_fell_behind_reads_what_it_has_missed(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(follower, "BACKLOG", 5)
    monkeypatch.setattr(follower, "RETRY_S", 0.0)
    log = Log()
    async with run_executive(FLEET) as control:
        following = asyncio.create_task(follow(control, log).run())
        run = await control.start(scenarios.question("Road?"))
        await until(lambda: log.opened == ["Road?"])
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, "continue", by="anna")
        await control.wait(run)
        last = (await control.records(run))[-1].seq
        await until(lambda: len(log.new) >= last)
    await following
    assert log.new == [(run, seq) for seq in range(1, last + 1)]
    assert [closed.by for closed in log.closed] == ["anna"]
    assert "fell 5 events behind" in caplog.text


class CutOff:
    """A control whose first subscriber is cut off."""

    def __init__(self, control: MissionControl, run: str) -> None:
        self._control = control
        self._run = run
        self.subscriptions = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self._control, name)

    async def subscribe(self, size: int) -> AsyncIterator[ControlEvent]:
        self.subscriptions += 1
        if self.subscriptions == 1:
            await self._control.pause(self._run, by="bob")
            raise OperatorError("the subscriber fell behind")
        for prompt in self._control.prompts():
            yield prompt


async def test_a_follower_that_was_cut_off_subscribes_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(follower, "RETRY_S", 0.0)
    async with run_executive(FLEET) as control:
        run = await control.start(scenarios.question("Road?"))
        cut_off = CutOff(control, run)
        log = Log()
        made = follow(cut_off, log)  # type: ignore[arg-type]
        await made.run()
        assert cut_off.subscriptions == 2
        assert made.views[run].status is RunStatus.PAUSED
        assert len(made.prompts) == 1
        assert log.loaded[:2] == [1, 2]
        assert log.statuses == [RunStatus.PAUSED]
        await control.stop(run)
