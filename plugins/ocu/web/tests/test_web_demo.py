"""`m2pem demo web`, which `make demo-web` runs."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.async_api import Browser, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_served import ENDS_WITHIN_S, REPOSITORY

pytestmark = IN_ONE_LOOP


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[str]:
    """The address that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "m2pem", "demo", "web", "--folder", str(tmp_path)],
        cwd=REPOSITORY,
        env={**os.environ, "M2PEM_WEB_PORT": "0"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    try:
        yield next(line.split()[-1] for line in process.stdout if "http" in line)
    finally:
        os.killpg(process.pid, signal.SIGINT)
        process.communicate(timeout=ENDS_WITHIN_S)


async def test_the_demo_serves_a_page_with_the_mission_of_the_paper(
    chromium: Browser, demo: str, tmp_path: Path
) -> None:
    async with page_at(chromium, demo) as it:
        await expect(it.page.get_by_role("link", name="vignette1", exact=True)).to_be_visible()
        it.assert_well()
    assert (tmp_path / "journal.db").is_file()
