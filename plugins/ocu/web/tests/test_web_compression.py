"""Answers of the REST interface are compressed for whoever accepts it, and are the same."""

import gzip

import httpx
import pytest
from m2pem_plugin_web.access.compression import LARGE, SMALLEST, CompressedAnswers, accepts_gzip
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.types import Receive, Scope, Send
from web_world import MakeWorld

pytestmark = pytest.mark.asyncio


async def answer(response: Response, accepted: str, path: str = "/api/it") -> httpx.Response:
    """What a client gets, whose body is not decompressed."""

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        await response(scope, receive, send)

    transport = httpx.ASGITransport(CompressedAnswers(app))
    async with httpx.AsyncClient(transport=transport, base_url="http://m2pem") as client:
        request = client.build_request("GET", path, headers={"accept-encoding": accepted})
        return await client.send(request)


@pytest.mark.parametrize("size", [SMALLEST, LARGE])
async def test_an_answer_is_compressed_where_that_is_accepted(size: int) -> None:
    whole = JSONResponse({"text": "survey " * size})
    got = await answer(whole, "br, gzip;q=0.5")
    assert got.headers["content-encoding"] == "gzip"
    assert got.headers["vary"] == "Accept-Encoding"
    assert int(got.headers["content-length"]) < len(whole.body) / 20
    assert got.content == whole.body
    plain = await answer(whole, "identity")
    assert "content-encoding" not in plain.headers
    assert plain.headers["vary"] == "Accept-Encoding"  # caches keep the two apart
    assert plain.content == whole.body


async def test_what_gains_nothing_stays_as_it_is() -> None:
    small = await answer(JSONResponse({"text": "s"}), "gzip")
    text = await answer(PlainTextResponse("picture " * SMALLEST), "gzip")
    done = gzip.compress(b'{"a": 1}' * SMALLEST)
    headers = {"content-encoding": "gzip", "content-type": "application/json"}
    compressed = await answer(Response(done, headers=headers), "gzip")
    tile = await answer(JSONResponse({"text": "s" * SMALLEST}), "gzip", "/tiles/1/1/1")
    assert [each.headers.get("content-encoding") for each in (small, text, compressed, tile)] == [
        None,
        None,
        "gzip",
        None,
    ]
    assert int(compressed.headers["content-length"]) == len(done)


@pytest.mark.parametrize(
    ("accepted", "right"),
    [("gzip", True), ("GZIP;q=1", True), ("gzip;q=0", False), ("gzip; q=0.0", False), ("", False)],
)
async def test_a_weight_of_zero_refuses(accepted: str, right: bool) -> None:
    assert accepts_gzip(accepted) is right


async def test_records_of_a_run_come_compressed(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        browser = await here.browser()
        page = await browser.http.get(f"/api/runs/{prompt.run}/records")
        assert page.headers["content-encoding"] == "gzip"
        assert len(page.json()["records"]) == len(await here.control.records(prompt.run))
