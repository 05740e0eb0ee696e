"""Several named operators at the same executive: who may what, and who was first."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser_world import WITHIN_MS, Browsing, Served, serving
from m2pem_plugin_web.access.passwords import hash_password
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.users import User, write_users
from playwright.async_api import Page, expect

expect.set_options(timeout=WITHIN_MS)

PASSWORD = "correct horse"


@pytest.fixture
def served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    """A server that knows anna (commander), bob (operator) and vera (viewer)."""
    users = tmp_path / "users.json"
    hashed = hash_password(PASSWORD)
    roles = {"anna": Role.COMMANDER, "bob": Role.OPERATOR, "vera": Role.VIEWER}
    write_users(users, {name: User(role, hashed) for name, role in roles.items()})
    monkeypatch.setenv("M2PEM_WEB_USERS", str(users))
    with serving(tmp_path) as server:
        server.tidy()
        yield server


async def sign_in(browsing: Browsing, name: str, path: str = "/") -> Page:
    """A window of its own, in which somebody signs in on the way to a page."""
    page = await browsing.begin()
    await page.goto(f"{browsing.served.base}{path}")
    await page.get_by_label("Name").fill(name)
    await page.get_by_label("Password").fill("wrong")
    await page.keyboard.press("Enter")
    await expect(page.get_by_text("Name or password is wrong.")).to_be_visible()
    await page.get_by_label("Password").fill(PASSWORD)
    await page.keyboard.press("Enter")
    await expect(page.locator(".who")).to_contain_text(name)
    # Somebody who has not signed in is refused, which the browser logs.
    browsing.faults[:] = [fault for fault in browsing.faults if "401" not in fault]
    return page


async def start(page: Page) -> str:
    """The address of a new run, without the server's name."""
    run = await page.evaluate(
        """async () => {
          const headers = { "Content-Type": "application/json" };
          const body = JSON.stringify({ mission: "vignette1" });
          return (await (await fetch("/api/runs", { method: "POST", headers, body })).json()).run;
        }"""
    )
    return f"/runs/{run}"


async def test_a_question_goes_to_all_and_the_second_is_told_who_was_first(
    browsing: Browsing,
) -> None:
    anna = await sign_in(browsing, "anna")
    path = await start(anna)
    await anna.goto(f"{browsing.served.base}{path}")
    bob = await sign_in(browsing, "bob", path)
    await expect(bob).to_have_url(f"{browsing.served.base}{path}")
    for page in (anna, bob):
        await expect(page.get_by_role("alertdialog")).to_be_visible()
    question = anna.get_by_role("alertdialog")
    await question.get_by_role("button", name="Continue").click()
    await expect(bob.get_by_text("anna was first: “Continue”")).to_be_visible()
    await expect(bob.get_by_role("alertdialog")).to_have_count(0)
    await expect(anna.get_by_text("was first")).to_have_count(0)


async def test_a_viewer_sees_all_and_steers_nothing(browsing: Browsing) -> None:
    anna = await sign_in(browsing, "anna")
    path = await start(anna)
    vera = await sign_in(browsing, "vera", path)
    question = vera.get_by_role("alertdialog")
    await expect(question).to_contain_text("Send the route, then continue")
    for button in await question.get_by_role("button", name=re.compile("Continue|Abort")).all():
        await expect(button).to_be_disabled()
    for name in ("STOP", "Pause", "Stop this run"):
        await expect(vera.get_by_role("button", name=name, exact=True)).to_be_disabled()
    await expect(vera.get_by_role("button", name="Take over")).to_have_count(0)
    await vera.keyboard.press("Shift+Escape")
    await expect(vera.locator(".stop-all")).to_have_text("STOP")


async def test_all_see_who_has_taken_a_vehicle(browsing: Browsing) -> None:
    anna = await sign_in(browsing, "anna")
    path = await start(anna)
    bob = await sign_in(browsing, "bob", path)
    await anna.goto(f"{browsing.served.base}{path}")
    await bob.locator(".card", has_text="evsg2").get_by_role("button", name="Take over").click()
    seen = anna.locator(".card", has_text="evsg2")
    await expect(seen).to_contain_text("with bob")
    await expect(seen.get_by_role("button", name="Give back")).to_be_disabled()
