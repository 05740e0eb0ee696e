"""Alerts on the page: the bell, its panel and the page of all, and how a browser tells new ones."""

import os
import re

from playwright.async_api import Browser, Page, expect
from web_axe import Accessibility
from web_desk import IN_ONE_LOOP, Desk, signed_in
from web_running import answer

pytestmark = IN_ONE_LOOP

NONE, ONE = "No alert needs you", "1 alert needs you"
STUBS = """() => {
  window.told = [];
  class Audio {
    state = "running"; currentTime = 0; destination = {};
    resume() { return Promise.resolve(); }
    createOscillator() {
      told.push("tone");
      const tone = { frequency: {}, connect: (to) => to, start() {}, stop() {} };
      return tone;
    }
    createGain() {
      const gain = { setValueAtTime() {}, exponentialRampToValueAtTime() {} };
      return { gain, connect: (to) => to };
    }
  }
  window.AudioContext = Audio;
  window.Notification = class {
    static permission = "default";
    static requestPermission() { this.permission = "granted"; return Promise.resolve("granted"); }
    constructor(title, { body }) { told.push(`${title}: ${body}`); }
  };
  Object.defineProperty(navigator, "vibrate", { value: () => told.push("vibrates") });
  window.speechSynthesis.speak = ({ text }) => told.push(`says ${text}`);
}"""


async def bell(page: Page, count: int) -> None:
    """Wait until so many alerts call."""
    name = {0: NONE, 1: ONE}.get(count, f"{count} alerts need you")
    await expect(page.get_by_role("button", name=name, exact=True)).to_be_visible()


async def accessible(page: Page, what: str) -> None:
    """Look at it with axe."""
    seen = Accessibility(page)
    await seen.look(what)
    seen.assert_well()


async def look(page: Page, name: str) -> None:
    if folder := os.environ.get("M2PEM_LOOK"):
        await page.screenshot(path=f"{folder}/{name}.png", animations="disabled")


async def test_an_alert_is_seen_acknowledged_and_owned_by_all_operators(
    chromium: Browser, desk: Desk
) -> None:
    page = desk.page
    async with signed_in(chromium, desk.executive, "otto") as otto:
        otto.watched.listen(otto.page)
        await otto.page.goto(desk.executive.origin)
        await desk.start()
        run = page.url.rpartition("/")[2]
        await bell(page, 1)
        await bell(otto.page, 1)
        await page.get_by_role("button", name=ONE).focus()
        await page.keyboard.press("Enter")
        panel = page.get_by_role("dialog", name="Alerts")
        question = panel.get_by_role("listitem")
        await expect(question).to_contain_text("Warning")
        await expect(question).to_contain_text(run)
        await look(page, "alert_panel")
        await accessible(page, "the panel of alerts")
        await question.get_by_role("button", name="Assign to me").click()
        await expect(question).to_contain_text("assigned to anna")
        await question.get_by_role("button", name="Acknowledge").click()
        await expect(question).to_contain_text("seen by anna")
        await bell(otto.page, 0)
        await page.keyboard.press("Escape")
        await expect(panel).to_have_count(0)
        await otto.page.get_by_role("button", name=NONE).click()
        seen = otto.page.get_by_role("dialog", name="Alerts")
        await expect(seen).to_contain_text("assigned to anna")
        await answer(page, "Abort").click()
        await expect(seen).to_contain_text("There is nothing that operators must know now.")
        await seen.get_by_role("link", name="All alerts and their history").click()
        over = otto.page.get_by_role("region", name="Ended").get_by_role("row", name=run).first
        await expect(over).to_contain_text("anna")
        await look(otto.page, "alert_page")
        await accessible(otto.page, "the page of alerts")
        otto.assert_well()


async def test_a_new_alert_is_told_in_the_ways_that_this_browser_wants(desk: Desk) -> None:
    await desk.page.close()
    page = await desk.another()
    await page.add_init_script(f"({STUBS})()")
    await page.goto(f"{desk.executive.origin}/alerts")
    for name in ("Messages of the browser", "Read aloud"):
        await page.get_by_label(name).check()
    sound = page.get_by_role("combobox", name="Sound")
    await expect(sound).to_have_value("critical")
    await sound.select_option("errors and worse")
    await page.get_by_role("button", name="Try it").click()
    said = "This is how an alert is announced."
    assert await page.evaluate("told.splice(0)") == [
        "tone",
        "tone",
        "vibrates",
        f"m2pem: Error: {said}",
        f"says {said}",
    ]
    await page.reload()
    await expect(page.get_by_label("Read aloud")).to_be_checked()
    await sound.select_option("off")
    await expect(page.locator(".link-open")).to_have_count(1)
    run = (await desk.ask("POST", "/api/runs", {"mission": "vignette1"}))["run"]
    await bell(page, 1)
    told = await page.evaluate("told")
    assert [each.partition(" ")[0] for each in told if each != "vibrates"] == ["says"]
    assert told[-1].startswith(f"says {run}: asks:")
    await expect(page).to_have_title(re.compile(r"^\(1\?\) m2pem "))
