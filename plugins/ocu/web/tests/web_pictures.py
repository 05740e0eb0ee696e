"""Pictures for docs/web.md. The tests take them while they look at the page anyway."""

import os

from playwright.async_api import Page
from web_served import REPOSITORY

IMAGES = REPOSITORY / "docs" / "images"


async def picture(page: Page, name: str) -> None:
    """Of what is seen now, into docs/images, if M2PEM_PICTURES is set: see `make pictures`."""
    if os.environ.get("M2PEM_PICTURES"):
        await page.mouse.move(0, 0)
        await page.screenshot(path=IMAGES / f"web_{name}.png", animations="disabled")
