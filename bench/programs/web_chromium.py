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


async def count_pictures(
    page: Page, address: str, warm_s: float, seconds: float, picture: str | None = None
) -> dict[str, Any]:
    """Open a run's page by an address that signs in, and count what it draws and receives.

    `warm_s`: from the diagram's first element on. `picture`: the file of a picture of the end.
    `cpu_percent`: of a core, in the page's process.
    """
    received = 0

    def count(text: str | bytes) -> None:
        nonlocal received
        received += str(text).startswith('{"type":"frame"')

    page.on("websocket", lambda socket: socket.on("framereceived", count))
    await page.goto(address)
    await page.locator(".drawing .djs-shape").first.wait_for()
    await asyncio.sleep(warm_s)
    tools = await page.context.new_cdp_session(page)
    await tools.send("Performance.enable")
    before, before_s = received, await _cpu_s(tools)
    answer: dict[str, Any] = await page.evaluate(_COUNT_PICTURES, seconds)
    answer |= {
        "told_per_s": (received - before) / seconds,
        "cpu_percent": (await _cpu_s(tools) - before_s) / seconds * 100,
    }
    if picture is not None:
        await page.screenshot(path=picture)
    return answer


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
