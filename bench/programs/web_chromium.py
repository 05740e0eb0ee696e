"""Chromium without a screen and without a graphics card, and what it draws of a page of m2pem."""

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from playwright.async_api import CDPSession, Page, async_playwright

ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
WITHIN_MS = 60_000

# Pictures that the browser drew, and the longest time between two.
_COUNT_PICTURES = """(seconds) => new Promise((resolve) => {
  const times = [];
  const draw = (now) => {
    times.push(now);
    if (now - times[0] < seconds * 1000) return requestAnimationFrame(draw);
    const gaps = times.slice(1).map((time, index) => time - times[index]);
    const took_s = (times.at(-1) - times[0]) / 1000;
    resolve({ fps: gaps.length / took_s, longest_ms: Math.max(...gaps) });
  };
  requestAnimationFrame(draw);
})"""


@asynccontextmanager
async def blank_page() -> AsyncIterator[Page]:
    """A page of a Chromium of its own, in 1,440 by 900 pixels."""
    async with async_playwright() as playwright:
        chromium = await playwright.chromium.launch(
            executable_path=shutil.which("chromium-headless-shell") or shutil.which("chromium"),
            args=ARGUMENTS,
        )
        try:
            page = await chromium.new_page(viewport={"width": 1440, "height": 900})
            page.set_default_timeout(WITHIN_MS)
            yield page
        finally:
            await chromium.close()


class Pictures:
    """Counts what a page draws and receives of a run."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._received = 0
        page.on("websocket", lambda socket: socket.on("framereceived", self._count))

    def _count(self, text: str | bytes) -> None:
        self._received += str(text).startswith('{"type":"frame"')

    async def open(self, address: str, warm_s: float) -> None:
        """Open the run's page by an address that signs in. `warm_s`: once it shows the diagram."""
        await self._page.goto(address)
        await self._page.locator(".drawing .djs-shape").first.wait_for()
        await asyncio.sleep(warm_s)

    async def count(self, seconds: float) -> dict[str, Any]:
        """Count for some seconds. `cpu_percent`: of a core, in the page's process."""
        tools = await self._page.context.new_cdp_session(self._page)
        await tools.send("Performance.enable")
        before, before_s = self._received, await _cpu_s(tools)
        answer: dict[str, Any] = await self._page.evaluate(_COUNT_PICTURES, seconds)
        return answer | {
            "told_per_s": (self._received - before) / seconds,
            "cpu_percent": (await _cpu_s(tools) - before_s) / seconds * 100,
        }


async def counted_all(page: Page, records: int) -> None:
    """Wait until a run's page has counted every record of the run."""
    await page.wait_for_function(
        "records => document.querySelector('.run-bar .events')"
        "?.textContent.replace(/[^0-9]/g, '') === String(records)",
        arg=records,
    )


async def _cpu_s(tools: CDPSession) -> float:
    """CPU time of the page's process so far."""
    answer = await tools.send("Performance.getMetrics")
    metrics = {each["name"]: each["value"] for each in answer["metrics"]}
    return float(metrics["ProcessTime"])
