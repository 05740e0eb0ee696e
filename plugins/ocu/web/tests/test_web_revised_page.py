"""A run that is watched goes on with a new version of its mission: the page shows its diagram."""

from playwright.async_api import expect
from web_desk import IN_ONE_LOOP, Desk

from m2pem.testing import scenarios

pytestmark = IN_ONE_LOOP

FIRST = scenarios.question()
SECOND = FIRST.replace(b'id="Question"', b'id="Question" name="Shall it go on?"')


async def test_the_page_shows_the_diagram_of_the_new_version(desk: Desk) -> None:
    page = desk.page
    (desk.executive.missions / "first.bpmn").write_bytes(FIRST)
    (desk.executive.missions / "second.bpmn").write_bytes(SECOND)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "first"}))["run"])
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    question = page.locator('[data-element-id="Question"]').first
    await expect(question).to_be_visible()
    await expect(question).not_to_contain_text("Shall it go on?")
    path = f"/api/runs/{run}/revision"
    plan = await desk.ask("POST", f"{path}/plan", {"mission": "second"})
    assert plan["possible"]
    await desk.ask("POST", path, {"mission": "second", "plan": plan["plan"]})
    await expect(question).to_contain_text("Shall")


async def test_the_page_of_a_revised_run_stays_as_it_is(desk: Desk) -> None:
    """The log that it gets first has the revision: it must not begin again because of it."""
    page = desk.page
    (desk.executive.missions / "first.bpmn").write_bytes(FIRST)
    (desk.executive.missions / "second.bpmn").write_bytes(SECOND)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "first"}))["run"])
    path = f"/api/runs/{run}/revision"
    plan = await desk.ask("POST", f"{path}/plan", {"mission": "second"})
    await desk.ask("POST", path, {"mission": "second", "plan": plan["plan"]})
    drawn: list[str] = []
    page.on("request", lambda sent: drawn.append(sent.url) if "/mission" in sent.url else None)
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    question = page.locator('[data-element-id="Question"]').first
    await expect(question).to_contain_text("Shall")
    handle = await question.element_handle()
    assert handle is not None
    for number in range(3):  # each is a message with records, which comes after those before
        await desk.ask("POST", f"/api/runs/{run}/notes", {"text": f"note {number}"})
        await expect(page.get_by_text(f"note {number}").first).to_be_visible()
    assert await handle.evaluate("each => each.isConnected")
    assert len(drawn) == 2, "read once, and compared once"
