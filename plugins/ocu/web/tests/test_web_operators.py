"""Several operators at real pages: who is first, who may, and what happens when something ends."""

import asyncio
import os
import shutil
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from m2pem_plugin_web.access.passwords import hash_password
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.users import User, write_users
from playwright.async_api import Browser, Page, expect
from web_browsing import Watched, browser, page_at
from web_running import answer, wait_for_status
from web_served import REPOSITORY, Served, served

NAME = "vignette1"
PASSWORD = "correct horse battery"
ROLES = {"anna": Role.COMMANDER, "otto": Role.OPERATOR, "vera": Role.VIEWER}
# Steering that the page has for those who may, and what the server says to those who may not.
STEERING = ["pause", "resume", "stop"]
REFUSED = """async ([run, what]) => {
  const path = what === "STOP" ? "/api/stop" : `/api/runs/${run}/${what}`;
  const said = { method: "POST", headers: { "Content-Type": "application/json" }, body: "{}" };
  return (await fetch(path, said)).status;
}"""


def put(executive: Served) -> None:
    shutil.copy(REPOSITORY / "missions" / f"{NAME}.bpmn", executive.missions)


def named_users(folder: Path) -> dict[str, str]:
    """Settings with users: all have the same password."""
    path = folder / "users.json"
    hashed = hash_password(PASSWORD)
    write_users(path, {name: User(role, hashed) for name, role in ROLES.items()})
    return {"M2PEM_WEB_USERS": str(path)}


@asynccontextmanager
async def signed_in(chromium: Browser, executive: Served, name: str) -> AsyncIterator[Watched]:
    """Somebody's own browser, on the first page."""
    async with page_at(chromium, f"{executive.origin}/sign-in") as it:
        await it.page.get_by_label("Name").fill(name)
        await it.page.get_by_label("Password").fill(PASSWORD)
        await it.page.get_by_role("button", name="Sign in").click()
        await expect(it.page.get_by_role("link", name=NAME)).to_be_visible()
        # Chromium logs that nobody was signed in when the page asked who is.
        it.complaints[:] = [each for each in it.complaints if "401" not in each]
        yield it


async def start(page: Page, executive: Served) -> str:
    """Start the mission from its page; the run's page."""
    await page.goto(f"{executive.origin}/missions/{NAME}")
    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_role("button", name="Start", exact=True).click()
    await page.wait_for_url("**/runs/*")
    await expect(answer(page, "Continue")).to_be_visible()
    return page.url


async def test_operators_see_the_same_and_the_first_answer_counts(tmp_path: Path) -> None:
    with served(tmp_path, environment=named_users(tmp_path)) as executive:
        put(executive)
        async with (
            browser() as chromium,
            signed_in(chromium, executive, "anna") as anna,
            signed_in(chromium, executive, "otto") as otto,
            signed_in(chromium, executive, "vera") as vera,
        ):
            run = await start(anna.page, executive)
            await otto.page.goto(run)
            await vera.page.goto(run)
            await expect(answer(otto.page, "Abort")).to_be_enabled()
            await see_viewer_cannot_steer(vera.page, run)
            await answer(anna.page, "Continue").click()
            told = "anna was first: “Continue”"
            await expect(otto.page.locator(".toasts")).to_contain_text(told)
            await expect(otto.page.get_by_role("alertdialog")).to_have_count(0)
            # An operator, who cannot start runs, stops them.
            await otto.page.get_by_role("button", name="Pause", exact=True).click()
            for each in (anna, otto, vera):
                await wait_for_status(each.page, "Paused")
            anna.assert_well()
            otto.assert_well()


async def see_viewer_cannot_steer(page: Page, run: str) -> None:
    """What steers is there to be seen, and does nothing; the server refuses it anyway."""
    await expect(answer(page, "Continue")).to_be_disabled()
    await expect(page.locator("header button.stop")).to_be_disabled()
    for name in ("Pause", "Stop this run", "Signal…", "Message…"):
        await expect(page.get_by_role("button", name=name, exact=True)).to_be_disabled()
    await expect(page.get_by_role("button", name="Take over")).to_have_count(0)
    for what in (*STEERING, "STOP"):
        assert await page.evaluate(REFUSED, [run.rpartition("/")[2], what]) == 403
    await page.keyboard.press("1")
    await expect(answer(page, "Continue")).to_be_visible()


def free_port() -> int:
    """Of 127.0.0.1. The page's address must not change when its executive is started again."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def test_a_page_comes_back_when_the_executive_does(tmp_path: Path) -> None:
    port = {"M2PEM_WEB_PORT": str(free_port()), **named_users(tmp_path)}
    words = ("--simulate", "--journal", str(tmp_path / "journal.db"))
    async with browser() as chromium:
        with served(tmp_path, words=words, environment=port) as executive:
            put(executive)
            async with signed_in(chromium, executive, "anna") as anna:
                page = anna.page
                await start(page, executive)
                executive.process.kill()
                await asyncio.to_thread(executive.process.wait)
                gone = page.get_by_text("Not connected to the executive")
                await expect(gone.first).to_be_visible()
                with served(tmp_path, words=words, environment=port):
                    # Nobody reloads, nobody signs in: it connects by itself, and the run goes on.
                    await expect(answer(page, "Continue")).to_be_enabled()
                    await wait_for_status(page, "Running")
                    await expect(gone).to_have_count(0)
                    await answer(page, "Continue").click()
                    await expect(page.locator(".vehicles-pane .card").first).to_contain_text(
                        "DRIVE ROUTE"
                    )


async def test_a_file_that_changed_on_disk_is_not_overwritten_unasked(tmp_path: Path) -> None:
    with served(tmp_path) as executive:
        put(executive)
        async with browser() as chromium, page_at(chromium, executive.url) as it:
            page = it.page
            await page.get_by_role("link", name=NAME).click()
            await page.click("[data-element-id=Reverse]")
            await page.get_by_label("Name", exact=True).fill("MINE")
            await page.get_by_label("Name", exact=True).press("Tab")
            path = executive.missions / f"{NAME}.bpmn"
            path.write_text(path.read_text().replace('name="REVERSE"', 'name="THEIRS"'))
            await page.get_by_role("button", name="Save", exact=True).click()
            asked = page.get_by_role("dialog", name="Somebody else changed this mission")
            await expect(asked).to_be_visible()
            assert 'name="THEIRS"' in path.read_text()
            await asked.get_by_role("button", name="Save mine as the newest version").click()
            await expect(page.locator(".m2-saved-state")).to_have_text("Saved")
            assert 'name="MINE"' in path.read_text()
            kept = executive.missions / ".versions"
            assert any('name="THEIRS"' in each.read_text() for each in files(kept))


def files(folder: Path) -> list[Path]:
    return [Path(root) / name for root, _, names in os.walk(folder) for name in names]


async def test_a_draft_outlives_its_tab(tmp_path: Path) -> None:
    with served(tmp_path) as executive:
        put(executive)
        async with browser() as chromium, page_at(chromium, executive.url) as it:
            page = it.page
            await page.get_by_role("link", name=NAME).click()
            await page.click("[data-element-id=Reverse]")
            await page.get_by_label("Name", exact=True).fill("BACK OFF")
            await page.get_by_label("Name", exact=True).press("Tab")
            async with asyncio.timeout(30):
                while not await page.evaluate(HAS_DRAFT, "BACK OFF"):
                    await page.evaluate("new Promise(requestAnimationFrame)")
            again = await it.context.new_page()
            # As in a crash, nothing of the page has a say.
            await crash(page)
            await again.goto(f"{executive.origin}/missions/{NAME}")
            await again.get_by_role("button", name="Go on with the draft").click()
            drawn = again.locator("[data-element-id=Reverse]").first
            await expect(drawn).to_contain_text("BACK OFF")
            await expect(again.locator(".m2-saved-state")).to_have_text("Not saved yet")


async def crash(page: Page) -> None:
    gone = asyncio.Event()
    page.on("crash", lambda _: gone.set())
    session = await page.context.new_cdp_session(page)
    ended = asyncio.create_task(session.send("Page.crash"))
    await asyncio.wait_for(gone.wait(), 20)
    ended.cancel()


HAS_DRAFT = """(text) => new Promise((resolve) => {
  const request = indexedDB.open("m2pem-editor");
  request.onsuccess = () => {
    const { result } = request;
    if (!result.objectStoreNames.contains("drafts")) return resolve(false);
    const drafts = result.transaction("drafts").objectStore("drafts").getAll();
    drafts.onsuccess = () => {
      result.close();
      resolve(drafts.result.some(({ xml }) => xml.includes(text)));
    };
  };
})"""
