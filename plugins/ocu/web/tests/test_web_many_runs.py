"""Many runs on the first page: found, sorted, and several of them paused and stopped together."""

import re

from playwright.async_api import expect
from test_web_alerts import accessible, look
from web_desk import IN_ONE_LOOP, Desk

pytestmark = IN_ONE_LOOP

QUESTION = b"""<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
<process id="ASKS" isExecutable="true"><startEvent id="S"/>
<userTask id="Ask" name="Ask"><extensionElements><m2pem:prompt>Go on?</m2pem:prompt>
<m2pem:decision value="yes" label="Yes"/></extensionElements></userTask>
<boundaryEvent id="Late" attachedToRef="Ask"><timerEventDefinition>
<timeDuration>PT10M</timeDuration></timerEventDefinition></boundaryEvent>
<endEvent id="E"/><endEvent id="L"/>
<sequenceFlow id="f1" sourceRef="S" targetRef="Ask"/>
<sequenceFlow id="f2" sourceRef="Ask" targetRef="E"/>
<sequenceFlow id="f3" sourceRef="Late" targetRef="L"/></process></definitions>"""


async def test_runs_are_found_and_several_are_paused_and_stopped_together(desk: Desk) -> None:
    (desk.executive.missions / "asks.bpmn").write_bytes(QUESTION)
    begun = [(await desk.ask("POST", "/api/runs", {"mission": "asks"}))["run"] for _ in range(3)]
    page = await desk.home()
    table = page.get_by_role("region", name="Runs")
    await page.get_by_role("searchbox", name="Find a run").fill("asks")
    await table.get_by_role("combobox", name="Status").select_option("not ended")
    rows = table.get_by_role("row").filter(has=page.get_by_role("cell"))
    await expect(rows).to_have_count(3)
    await table.get_by_role("button", name="Began").click()
    await expect(rows.first).to_contain_text(begun[2])
    await table.get_by_role("button", name="Began").click()
    await expect(rows.first).to_contain_text(begun[0])
    for run in begun[:2]:
        await table.get_by_role("checkbox", name=f"Select {run}", exact=True).check()
    await look(page, "runs")
    await accessible(page, "the table of runs")
    await table.get_by_role("button", name="Pause", exact=True).click()
    asked = page.get_by_role("dialog", name="Pause 2 runs?")
    await expect(asked.get_by_role("listitem")).to_have_count(2)
    await asked.get_by_role("button", name="Pause", exact=True).click()
    for run in begun[:2]:
        await expect(asked).to_contain_text(re.compile(rf"{run} asks paused"))
    await asked.get_by_role("button", name="Close").last.click()
    await expect(rows.filter(has_text="Paused")).to_have_count(2)
    await table.get_by_role("checkbox", name="Select all on this page").check()
    await table.get_by_role("button", name="Stop", exact=True).click()
    asked = page.get_by_role("dialog", name="Stop 3 runs?")
    await look(page, "runs_stop")
    await asked.get_by_role("button", name="Stop", exact=True).click()
    await expect(asked.get_by_text("stopped", exact=True)).to_have_count(3)
    await asked.get_by_role("button", name="Close").last.click()
    await expect(table).to_contain_text("No run matches.")


async def test_a_question_shows_how_long_it_can_still_be_answered(desk: Desk) -> None:
    (desk.executive.missions / "asks.bpmn").write_bytes(QUESTION)
    run = (await desk.ask("POST", "/api/runs", {"mission": "asks"}))["run"]
    await desk.page.goto(f"{desk.executive.origin}/runs/{run}")
    question = desk.page.get_by_role("alertdialog")
    await expect(question.get_by_role("timer")).to_have_text(re.compile(r"^(10:00|9:5\d) left$"))
    await expect(desk.page.locator(".bell-left")).to_have_text(re.compile(r"^(10:00|9:[45]\d)$"))
    await look(desk.page, "countdown")
