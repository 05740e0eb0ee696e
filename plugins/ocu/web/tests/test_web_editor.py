"""The editor in a real browser: drawing by keyboard, forms, conditions, signals, and checks."""

import re

from playwright.async_api import Page, expect
from web_desk import IN_ONE_LOOP, Desk
from web_drawing import SAVED, Drawing, new_mission

from m2pem import load_mission
from m2pem.mission.elements import ScriptTask, SequenceFlow, UserTask

pytestmark = IN_ONE_LOOP


async def appended(page: Page, word: str) -> None:
    """Append by keyboard what a word finds, to what is selected."""
    await page.locator("svg[data-element-id]").first.focus()
    await page.keyboard.press("a")
    search = page.locator(".djs-popup-search input")
    await search.press_sequentially(word)
    await expect(page.locator(".djs-popup .entry").first).to_contain_text(re.compile(word, re.I))
    await page.keyboard.press("Enter")
    await expect(page.locator(".djs-popup")).to_have_count(0)
    await page.keyboard.press("Escape")


async def test_a_mission_is_drawn_by_keyboard_and_saved(desk: Desk) -> None:
    page = await desk.home()
    await new_mission(page, "patrol")
    await page.click("[data-element-id=Start]")
    await appended(page, "Ask the operator")
    await page.get_by_label("Question", exact=True).fill("Drive on?")
    await appended(page, "Exclusive gateway")
    await appended(page, "Single vehicle routing")
    await page.get_by_label("Route").fill("route_alpha")
    await page.get_by_label("Who", exact=False).first.select_option("evsg1")
    await appended(page, "Terminate end event")
    await Drawing(page).save()
    mission = load_mission(desk.executive.missions / "patrol.bpmn")
    drive = next(each for each in mission.nodes if isinstance(each, ScriptTask))
    assert drive.behavior is not None
    assert [(role.name, role.resource) for role in drive.behavior.roles] == [("driver", "evsg1")]
    assert [each.name for each in drive.behavior.parameters] == ["route"]
    ask = next(each for each in mission.nodes if isinstance(each, UserTask))
    assert ask.prompt is not None
    assert ask.prompt.text == "Drive on?"
    assert [each.value for each in ask.prompt.decisions] == ["continue", "abort"]


async def test_a_condition_is_completed_and_checked_while_it_is_typed(desk: Desk) -> None:
    page = await desk.edit()
    await page.locator("[data-element-id=FlowContinue] .djs-hit").first.click(force=True)
    condition = page.get_by_label("Taken when")
    await condition.fill("")
    await condition.press_sequentially("user.dec")
    await page.get_by_role("option", name="user.decision").click()
    await condition.press_sequentially(" == ")
    offered = page.locator(".cm-tooltip-autocomplete:not(.cm-tooltip-autocomplete-disabled)")
    await expect(offered.get_by_role("option").first).to_contain_text("'continue'")
    await page.keyboard.press("ArrowDown")
    await page.keyboard.press("Enter")
    await expect(condition).to_have_text("user.decision == 'continue'")
    await condition.press_sequentially(" and")
    await expect(page.locator("#m2-condition-error")).to_be_visible()
    await condition.fill("user.decision == 'continue'")
    await expect(page.locator("#m2-condition-error")).to_have_count(0)
    await Drawing(page).save()
    mission = load_mission(desk.executive.missions / "vignette1.bpmn")
    flow = next(each for each in mission.flows if each.id == "FlowContinue")
    assert isinstance(flow, SequenceFlow)
    assert str(flow.condition) == "user.decision == 'continue'"


async def test_a_problem_is_marked_and_leads_to_its_element(desk: Desk) -> None:
    page = await desk.edit()
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Distance").fill("10 s")
    await expect(page.locator("#m2-parameter-distance-error")).to_contain_text("does not fit")
    await expect(page.locator("[data-element-id=Reverse]")).to_have_class(
        re.compile("m2-has-error")
    )
    await page.click("[data-element-id=StartVignette1]")
    await page.get_by_role("tab", name="Problems").click()
    await page.get_by_role("button", name=re.compile("REVERSE")).click()
    await expect(page.locator("[data-element-id=Reverse]")).to_have_class(re.compile("selected"))
    await page.keyboard.press("Control+z")
    await expect(page.locator(".m2-problems-head p")).to_have_text("No problems found.")
    await expect(page.locator(SAVED)).to_have_text("Saved")


async def test_a_role_says_what_it_needs(desk: Desk) -> None:
    page = await desk.edit()
    await page.click("[data-element-id=Reverse]")
    await page.get_by_label("Who", exact=False).first.select_option("Chosen when the task starts")
    await page.get_by_label("What it must be or have").fill("vehicle.domain == 'ground'")
    await page.get_by_text("More about the choice").click()
    await page.get_by_label("Wait for at most").fill("10 min")
    await page.get_by_label("Wait for at most").blur()
    await Drawing(page).save()
    mission = load_mission(desk.executive.missions / "vignette1.bpmn")
    reverse = mission.elements["Reverse"]
    assert isinstance(reverse, ScriptTask)
    assert reverse.behavior is not None
    (role,) = reverse.behavior.roles
    assert role.need is not None
    assert role.need.condition is not None
    assert (role.resource, role.need.condition.text) == ("", "vehicle.domain == 'ground'")
    assert (role.need.waits, str(role.need.wait_limit)) == (True, "PT10M")


async def test_signals_are_made_by_name_and_shared(desk: Desk) -> None:
    page = await desk.edit()
    await page.click("[data-element-id=SignalStop]")
    signal = page.get_by_role("combobox", name="Signal", exact=False)
    await expect(signal).to_have_value("Stop driving")
    await signal.fill("Halt")
    await page.get_by_label("Sent by operators").check()
    await page.click("[data-element-id=ThrowStop]")
    await signal.click()
    await page.get_by_role("option", name="Halt").click()
    await expect(page.get_by_text("Shared by 2 events")).to_be_visible()
    await Drawing(page).save()
    text = (desk.executive.missions / "vignette1.bpmn").read_text()
    made = re.search(
        r'<bpmn:signal id="([a-f][0-9a-f-]{35})" name="Halt" m2pem:from="operator"', text
    )
    assert made
    assert text.count(f'signalRef="{made.group(1)}"') == 2


async def test_keys_typed_into_a_field_are_for_the_field(desk: Desk) -> None:
    page = await desk.edit()
    await page.click("[data-element-id=Reverse]")
    for key in ("Control+z", "Control+y"):
        await page.get_by_label("Documentation").fill("n a r")
        await page.get_by_label("Documentation").press(key)
        await expect(page.locator("[data-element-id=Reverse]")).to_have_count(1)
        await expect(page.locator(".djs-popup")).to_have_count(0)
