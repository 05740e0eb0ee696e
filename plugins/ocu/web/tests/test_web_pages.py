"""The page in a real browser: it comes up, and complains about nothing."""

from pathlib import Path

from web_browsing import browser, page_at
from web_served import served


async def test_the_printed_address_signs_in(tmp_path: Path) -> None:
    with served(tmp_path) as executive:
        async with browser() as chromium, page_at(chromium, executive.url) as it:
            await it.page.get_by_role("heading", name="Missions").wait_for()
            assert "token" not in it.page.url
            it.assert_well()
