"""An executive that is started again: pages go on, and so do the runs that they watch."""

import shutil
import socket
from contextlib import AsyncExitStack
from pathlib import Path

from web_world import Browser, World, executive, serving

from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing import scenarios


def free_port() -> str:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return str(one.getsockname()[1])


def left_by_a_crash(folder: Path) -> Path:
    """A copy of the journal from before anything was wound up."""
    copy = folder / "crashed"
    copy.mkdir()
    for file in folder.glob("journal.db*"):
        if file.is_dir():
            shutil.copytree(file, copy / file.name)
        else:
            (copy / file.name).write_bytes(file.read_bytes())
    return copy


async def begun(stack: AsyncExitStack, folder: Path, port: str) -> tuple[World, SqliteJournal]:
    """An executive with its page, until the stack is closed; runs of before are taken up."""
    journal = SqliteJournal.open(folder / "journal.db")
    stack.push_async_callback(journal.close)
    running = await stack.enter_async_context(executive(journal))
    for line in await journal.runs():
        if line.outcome is None:
            await running.resume(line.run)
    served = serving(running.control, folder, {"M2PEM_WEB_PORT": port})
    return await stack.enter_async_context(served), journal


async def test_a_page_goes_on_after_the_executive_was_started_again(tmp_path: Path) -> None:
    port = free_port()
    async with AsyncExitStack() as stack:
        first, _ = await begun(stack, tmp_path, port)
        browser = await first.browser()
        ended = await first.asked(scenarios.question("Before?"))
        await (await browser.live()).watch(ended.run)
        cookie, base, key = browser.cookie, first.base, browser.key
    async with AsyncExitStack() as stack:
        second, _ = await begun(stack, tmp_path, port)
        assert second.base == base
        again = Browser(base)
        second.browsers.append(again)
        name, _, value = cookie.partition("=")
        again.http.cookies.set(name, value)
        again.key = key
        assert (await again.http.get("/api/session")).status_code == 200
        live = await again.live()
        told = await live.watch(ended.run)
        assert told["status"] == "stopped", "shutting down has stopped it"
        prompt = await second.asked(scenarios.question("After?"))
        assert prompt.run == "r2"
        await live.until(lambda message: message.get("prompt", {}).get("run") == "r2")


async def test_a_run_that_was_interrupted_is_shown_as_it_stands(tmp_path: Path) -> None:
    journal = SqliteJournal.open(tmp_path / "journal.db")
    async with executive(journal) as crashed:
        run = await crashed.control.start(scenarios.question("Still there?"))
        copy = left_by_a_crash(tmp_path)
    await journal.close()
    async with AsyncExitStack() as stack:
        world, _ = await begun(stack, copy, "0")
        live = await (await world.browser()).live()
        told = await live.watch(run)
        (elements,) = told["elements"].values()
        assert [name for name, state in elements.items() if state["asking"]]
        assert [each["text"] for each in told["prompts"]] == ["Still there?"]
        assert told["status"] == "running"
        browser = world.browsers[0]
        path = f"/api/runs/{run}/prompts/{told['prompts'][0]['prompt']}"
        answer = await browser.http.post(path, json={"decision": "abort"})
        assert answer.status_code == 204
        await live.until(lambda message: message["type"] == "prompt_closed")
