"""The page and a standby: who comes there is told who serves, and an open page goes on there."""

import re
import signal
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from httpx import ASGITransport, AsyncClient
from m2pem_plugin_web.standby import create_app
from playwright.async_api import expect
from test_web_restart import free_port
from web_browsing import browser

from m2pem.api import ExecutiveAddress
from tests.command_line import FLEET, CommandLine, Program, command_line


async def test_a_standby_is_live_and_not_ready_and_tells_who_serves() -> None:
    serves = ExecutiveAddress("gcs1", 4711, "https://gcs1:8700/")
    served_by: list[ExecutiveAddress | None] = [serves]
    app = create_app("north <1>", lambda: served_by[-1])
    async with AsyncClient(transport=ASGITransport(app), base_url="http://gcs2") as http:
        assert (await http.get("/healthz")).status_code == 200
        ready = await http.get("/readyz")
        assert ready.status_code == 503
        assert ready.json() == {
            "status": "standby",
            "served_by": {"host": "gcs1", "pid": 4711, "page": "https://gcs1:8700/"},
        }
        page = await http.get("/runs/r1")
        assert page.status_code == 503
        assert "Process 4711 on gcs1 serves north &lt;1&gt;" in page.text
        assert '<a href="https://gcs1:8700/">' in page.text
        for method, path in (("GET", "/api/runs/r1"), ("POST", "/api/runs/r1/revision")):
            refused = await http.request(method, path, json={} if method == "POST" else None)
            assert refused.status_code == 503
            assert refused.headers["content-type"] == "application/problem+json"
            assert "this executive stands by for north <1>" in refused.json()["detail"]
            assert refused.json()["served_by"]["pid"] == 4711
        served_by.append(ExecutiveAddress("gcs1", 4711, "javascript:alert(1)"))
        assert "href" not in (await http.get("/")).text
        served_by.append(None)
        assert "is not known now" in (await http.get("/")).text
        assert (await http.get("/readyz")).json()["served_by"] is None


@pytest.fixture
def m2pem(tmp_path: Path) -> Iterator[CommandLine]:
    yield from command_line(tmp_path)


def serve(m2pem: CommandLine, port: str, *words: str) -> Program:
    """Start an executive with a page at a port."""
    return m2pem.start(
        "serve", "--fleet", FLEET, "--simulate", "--journal", "journal.db", "--ocu", "web", *words,
        M2PEM_WEB_PORT=port,
    )  # fmt: skip


def page_of(program: Program) -> str:
    """Return the address of its page, with the token, once it is printed."""
    return program.until_said("the page is at").split()[-1]


@pytest.mark.long
async def test_an_open_page_goes_on_at_the_standby_that_has_taken_over(m2pem: CommandLine) -> None:
    first, second = free_port(), free_port()
    owner = serve(m2pem, first)
    at_first = page_of(owner)
    standby = serve(m2pem, second, "--standby")
    standby.until_said("standing by for")
    async with browser() as chromium:
        page = await chromium.new_page()
        await page.goto(f"http://127.0.0.1:{second}/")
        await page.get_by_role("link", name=f"http://127.0.0.1:{first}/").click()
        await page.wait_for_url(f"http://127.0.0.1:{first}/**")
        await page.goto(at_first)
        link = page.locator(".link-open")
        stands_by = re.compile(rf"Standby: process {standby.process.pid} on ")
        await expect(link).to_have_attribute("title", stands_by)
        await page.reload()  # a page that was opened before the standby began may not ask it
        await expect(link).to_have_attribute("title", stands_by)
        owner.send(signal.SIGKILL)
        at_second = page_of(standby)
        await page.wait_for_url(f"http://127.0.0.1:{second}/sign-in**", timeout=30_000)
        await page.goto(at_second)
        await expect(link).to_have_attribute("title", re.compile("No standby"))
        assert urlsplit(page.url).netloc == f"127.0.0.1:{second}"
        await page.context.close()
