"""Shared space on the page: in a table and on the map, while a task waits for it."""

from pathlib import Path

from playwright.async_api import Browser, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_served import served

from tests.deconfliction.test_clearance_simulate import both_ways, write_rovers

pytestmark = IN_ONE_LOOP


async def test_the_page_shows_who_is_on_the_bridge_and_who_waits_for_it(
    chromium: Browser, tmp_path: Path
) -> None:
    with served(tmp_path, fleet=write_rovers(tmp_path)) as executive:
        (executive.missions / "both.bpmn").write_bytes(both_ways())
        async with page_at(chromium, executive.url) as it:
            run = await it.page.evaluate(
                """async () => {
                  const key = JSON.parse(localStorage.getItem("m2pem.key"));
                  const headers = { "Content-Type": "application/json", "M2pem-Key": key };
                  const body = JSON.stringify({ mission: "both" });
                  const answer = await fetch("/api/runs", { method: "POST", headers, body });
                  return (await answer.json()).run;
                }"""
            )
            await it.page.goto(f"{executive.origin}/runs/{run}")
            space = it.page.get_by_role("region", name="Shared space")
            row = space.get_by_role("row").filter(has_text="bridge")
            await expect(row).to_contain_text("1 of 1")
            await expect(row).to_contain_text(f"one {run}.b1")
            await expect(row).to_contain_text(f"West of {run}, ")
            name = it.page.locator(".map-space").last  # those before fade out
            await expect(name).to_have_text("bridge: 1 of 1 · one · 1 waiting")
            it.assert_well()
