"""Errors that stop a task, on the page: what is chosen is done, and what follows is said."""

from playwright.async_api import expect
from web_desk import IN_ONE_LOOP, Desk

pytestmark = IN_ONE_LOOP

STOPPING = b"""<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="https://m2pem.org/schema/1" targetNamespace="test">
  <process id="P" isExecutable="true" m2pem:onError="incident">
    <startEvent id="S"/> <scriptTask id="Bad" name="Look at the gate">
      <script>throw error BAD</script></scriptTask>
    <userTask id="Ask" name="All well?"/> <endEvent id="E"/>
    <sequenceFlow id="a" sourceRef="S" targetRef="Bad"/>
    <sequenceFlow id="b" sourceRef="Bad" targetRef="Ask"/>
    <sequenceFlow id="c" sourceRef="Ask" targetRef="E"/>
  </process>
</definitions>
"""


async def test_an_operator_decides_about_an_error_that_stops_a_task(desk: Desk) -> None:
    page = desk.page
    (desk.executive.missions / "stopping.bpmn").write_bytes(STOPPING)
    run = str((await desk.ask("POST", "/api/runs", {"mission": "stopping"}))["run"])
    await page.goto(f"{desk.executive.origin}/runs/{run}")
    panel = page.get_by_role("alertdialog", name=f"Look at the gate is stopped (run {run})")
    await expect(panel).to_contain_text("BAD")
    await panel.get_by_label("What is to be done").select_option("set_data")
    await panel.get_by_label("Data (JSON)").fill('{"gate": "open"}')
    await panel.get_by_role("button", name="Decide", exact=True).click()
    await expect(panel.get_by_label("Data (JSON)")).to_have_value("")
    await panel.get_by_label("What is to be done").select_option("skip")
    await panel.get_by_role("button", name="What follows?").click()
    await expect(panel.get_by_role("status")).to_contain_text("the mission")
    await panel.get_by_role("button", name="Decide", exact=True).click()
    await expect(panel).to_have_count(0)
    await expect(page.get_by_role("alertdialog", name="Question")).to_be_visible()
    records = (await desk.ask("GET", f"/api/runs/{run}/records"))["records"]
    (resolved,) = [each for each in records if each["record"] == "IncidentResolved"]
    assert (resolved["choice"], resolved["by"]) == ("skip", "anna")
    assert {each["key"]: each["value"] for each in records if each["record"] == "DataWritten"} == {
        "gate": "open"
    }


async def test_incidents_of_the_run_that_is_shown_come_first(desk: Desk) -> None:
    page = desk.page
    (desk.executive.missions / "stopping.bpmn").write_bytes(STOPPING)
    first, second = [
        str((await desk.ask("POST", "/api/runs", {"mission": "stopping"}))["run"]) for _ in range(2)
    ]
    await desk.until("/api/incidents", lambda said: len(said) == 2)
    await page.goto(f"{desk.executive.origin}/runs/{second}")
    panel = page.get_by_role("alertdialog")
    await expect(panel).to_have_accessible_name(f"Look at the gate is stopped (run {second})")
    await panel.get_by_label("What is to be done").select_option("skip")
    await panel.get_by_role("button", name="Next incident (1 of 2)").click()
    await expect(panel).to_have_accessible_name(f"Look at the gate is stopped (run {first})")
    # What was chosen for the other one is not chosen for this one.
    await expect(panel.get_by_label("What is to be done")).to_have_value("retry")
    await panel.get_by_label("What is to be done").select_option("end")
    await panel.get_by_role("button", name="Decide", exact=True).click()
    await desk.until(f"/api/runs/{first}", lambda said: said["status"] == "failed")
    await expect(panel).to_have_accessible_name(f"Look at the gate is stopped (run {second})")
