"""A real browser, and what went wrong in it."""

import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from playwright.async_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    async_playwright,
    expect,
)

# Nothing leaves this machine: neither updates nor the experiments of the browser's maker.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
TIMEOUT_MS = 30_000
expect.set_options(timeout=TIMEOUT_MS)


def chromium() -> str:
    """The browser of this machine, without windows if it has that: it needs less time.

    The tests fail where there is none.
    """
    names = ("chromium-headless-shell", "chromium", "chromium-browser")
    program = next(filter(None, map(shutil.which, names)), None)
    assert program, "these tests need Chromium: apt-get install chromium-headless-shell"
    return program


@asynccontextmanager
async def browser() -> AsyncIterator[Browser]:
    """Started and ended."""
    async with async_playwright() as playwright:
        started = await playwright.chromium.launch(
            executable_path=chromium(), args=ARGUMENTS, headless=True
        )
        try:
            yield started
        finally:
            await started.close()


KEY = """"M2pem-Key": JSON.parse(localStorage.getItem("m2pem.key"))"""
"""A header, for requests of scripts of tests in a page that has signed in."""


SIGN_IN = """async ([name, password]) => {
  const body = JSON.stringify({ name, password });
  const headers = { "Content-Type": "application/json" };
  const answer = await fetch("/api/session", { method: "POST", headers, body });
  const { key } = await answer.json();
  localStorage.setItem("m2pem.key", JSON.stringify(key));
  return key;
}"""
"""Signs in where the page does not: with name and password. Returns the key of the session."""


@dataclass(slots=True)
class Watched:
    """A page, and all that it complained about: errors that nobody caught, and on the console."""

    page: Page
    context: BrowserContext
    complaints: list[str] = field(default_factory=list)

    def listen(self, page: Page) -> None:
        """Keep what a page complains about."""

        def on_console(message: ConsoleMessage) -> None:
            if message.type == "error":
                self.complaints.append(message.text)

        page.on("console", on_console)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def assert_well(self) -> None:
        """Nothing was complained about."""
        assert self.complaints == []


@asynccontextmanager
async def page_at(
    started: Browser,
    url: str,
    *,
    width: int = 1280,
    height: int = 720,
    dark: bool = False,
    language: str = "en-US",
    offline: bool = False,
    touch: bool = False,
) -> AsyncIterator[Watched]:
    """A page of its own profile, so of its own operator, at an address.

    `offline`: it keeps its own files, which other tests do without: what they do to its requests
    would pass the service worker by.
    """
    context = await started.new_context(
        viewport={"width": width, "height": height},
        color_scheme="dark" if dark else "light",
        reduced_motion="reduce",
        accept_downloads=True,
        locale=language,
        has_touch=touch,
        service_workers="allow" if offline else "block",
        permissions=["clipboard-read", "clipboard-write"],
    )
    context.set_default_timeout(TIMEOUT_MS)
    page = await context.new_page()
    watched = Watched(page, context)
    watched.listen(page)
    try:
        await page.goto(url)
        if "token=" in url:
            await page.locator(".who").wait_for(state="attached")  # the page has signed in
        yield watched
    finally:
        await context.close()
