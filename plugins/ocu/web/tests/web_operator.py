"""An operator at a browser of their own, at a desk or on a phone, who never reloads a page."""

import os
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from playwright.async_api import Browser, Locator, Page, expect
from test_web_alerts import STUBS
from web_browsing import TIMEOUT_MS, Watched
from web_world import PASSWORD

ASKED_FOR = re.compile(r"ERR_|WebSocket connection|status of 409")
"""What a browser notes of a dead network, of an executive that is down, and of a start whose
vehicles are busy."""
NOT_SIGNED_IN = "Failed to load resource: the server responded with a status of 401 (Unauthorized)"
"""What a browser notes when the page asks who has signed in."""


@dataclass(slots=True)
class Person:
    """An operator at a browser; what the page shows is reached by its own links and buttons."""

    name: str
    page: Page
    watched: Watched
    touch: bool
    documents: list[str] = field(default_factory=list)
    """That the browser has loaded: more than one, if the page was reloaded or left."""

    async def press(self, what: Locator) -> None:
        await (what.tap() if self.touch else what.click())

    async def go(self, name: str) -> None:
        """To one of the pages that the header names."""
        pages = self.page.get_by_role("navigation", name="Pages")
        await self.press(pages.get_by_role("link", name=name, exact=True))

    async def sign_in(self, origin: str) -> None:
        self.page.on("domcontentloaded", lambda _: self.documents.append(self.page.url))
        await self.page.goto(origin)
        await self.page.get_by_label("Name").fill(self.name)
        await self.page.get_by_label("Password").fill(PASSWORD)
        await self.press(self.page.get_by_role("button", name="Sign in"))
        await expect(self.page.locator(".link-open")).to_have_count(1)
        await self.page.evaluate("window.sinceSignIn = true")
        assert self.watched.complaints == [NOT_SIGNED_IN]
        self.watched.complaints.clear()

    def bell(self, count: int | None = None) -> Locator:
        """The bell of the header, that says how many alerts call; None: any number."""
        if count is None:
            return self.page.get_by_role("button", name=re.compile("alerts? needs? you$"))
        name = {0: "No alert needs you", 1: "1 alert needs you"}.get(count)
        return self.page.get_by_role("button", name=name or f"{count} alerts need you", exact=True)

    async def to_alert(self, text: str) -> None:
        """To the run that an alert is about, by the alert."""
        await self.press(self.bell())
        panel = self.page.get_by_role("dialog", name="Alerts")
        alert = panel.get_by_role("listitem").filter(has_text=text)
        await self.press(alert.get_by_role("link"))
        await expect(panel).to_have_count(0)

    async def decide(self, title: str, choice: str, other: str = "") -> None:
        """Decide about an incident of the run that the page shows."""
        panel = self.page.get_by_role("alertdialog", name=re.compile(f"^{title} is stopped"))
        await panel.get_by_label("What is to be done").select_option(choice)
        if other:
            await panel.get_by_label("Vehicle or payload", exact=True).fill(other)
        await self.press(panel.get_by_role("button", name="Decide", exact=True))
        await expect(panel).to_have_count(0)

    def row(self, name: str) -> Locator:
        """Of a vehicle on the page of the fleet."""
        header = self.page.get_by_role("rowheader", name=name, exact=True)
        return self.page.get_by_role("row").filter(has=header)

    def commands(self) -> Locator:
        return self.page.get_by_role("region", name="Details and commands")

    async def command(self, name: str) -> None:
        await self.press(self.commands().get_by_role("button", name=name, exact=True))

    async def look(self, name: str) -> None:
        if folder := os.environ.get("M2PEM_LOOK"):
            path = f"{folder}/day_{self.name}_{name}.png"
            await self.page.screenshot(path=path, animations="disabled")

    async def assert_never_reloaded(self) -> None:
        """One navigation, when they signed in, and the same document since, which complained about
        nothing that was not asked for."""
        said = self.watched.complaints
        assert [text for text in said if not ASKED_FOR.search(text)] == [], said
        assert len(self.documents) == 1, self.documents
        assert await self.page.evaluate("window.sinceSignIn")
        entries = "performance.getEntriesByType('navigation').map(({ type }) => type)"
        assert await self.page.evaluate(entries) == ["navigate"]


@asynccontextmanager
async def person(
    chromium: Browser, name: str, width: int, height: int, *, touch: bool
) -> AsyncIterator[Person]:
    context = await chromium.new_context(
        viewport={"width": width, "height": height},
        has_touch=touch,
        is_mobile=touch,
        reduced_motion="reduce",
    )
    context.set_default_timeout(TIMEOUT_MS)
    page = await context.new_page()
    await page.add_init_script(f"({STUBS})()")
    watched = Watched(page, context)
    watched.listen(page)
    made = Person(name, page, watched, touch)
    try:
        yield made
    finally:
        await made.look("end")
        await context.close()
