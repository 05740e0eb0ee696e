"""The day of two operators, at a desk and on a phone, with 20 vehicles: no page is ever reloaded.

What happens, in this order: they sign in, missions begin, wait and are scheduled, a vehicle loses
its link, tasks are stopped by errors, a detection interrupts and a question is answered, vehicles
are handed over and commanded by hand, runs are paused and stopped, one is replayed, a network dies,
the executive is killed, STOP reaches every vehicle, and all alerts are acknowledged.
"""

import asyncio
import re
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractContextManager, AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pytest
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.users import User, write_users
from playwright.async_api import Browser, Page, expect
from playwright.async_api import TimeoutError as PlaywrightTimeoutError
from test_web_operators import free_port
from web_browsing import TIMEOUT_MS
from web_day import LOST, VEHICLES, write_fleet, write_missions
from web_desk import IN_ONE_LOOP, POLL_S
from web_operator import Person, person
from web_proxy import Proxy, proxy_to
from web_running import press_twice
from web_served import Served, served
from web_world import HASHED

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects

pytestmark = IN_ONE_LOOP

PEOPLE = {"anna": Role.COMMANDER, "otto": Role.OPERATOR}
SPEED = "5"
AGAIN_MS = 2000


@dataclass(slots=True)
class Day:
    """Anna at her desk, Otto with a phone, whose network is `proxy`. `serve` starts the executive,
    at the same port each time."""

    anna: Person
    otto: Person
    proxy: Proxy
    folder: Path
    executive: Served
    serve: Callable[[], AbstractContextManager[Served]]
    run: dict[str, str] = field(default_factory=dict)
    """The run of each mission."""


@asynccontextmanager
async def morning(chromium: Browser, folder: Path) -> AsyncIterator[Day]:
    """The executive serves, and both operators have signed in."""
    users = folder / "users.json"
    write_users(users, {name: User(role, HASHED()) for name, role in PEOPLE.items()})
    port = {"M2PEM_WEB_PORT": str(free_port()), "M2PEM_WEB_USERS": str(users)}
    words = ("--simulate", "--speed", SPEED, "--journal", str(folder / "journal.db"))
    serve = partial(served, folder, fleet=write_fleet(folder), words=words, environment=port)
    async with AsyncExitStack() as stack:
        executive = stack.enter_context(serve())
        write_missions(executive.missions)
        proxy = await stack.enter_async_context(proxy_to(executive.origin))
        anna = await stack.enter_async_context(person(chromium, "anna", 1440, 900, touch=False))
        otto = await stack.enter_async_context(person(chromium, "otto", 390, 844, touch=True))
        await asyncio.gather(
            anna.sign_in(executive.origin), otto.sign_in(f"http://127.0.0.1:{proxy.port}")
        )
        yield Day(anna, otto, proxy, folder, executive, serve)


async def test_a_network_dies_and_the_phone_stops_all_without_a_reload(
    chromium: Browser, tmp_path: Path
) -> None:
    async with morning(chromium, tmp_path) as day:
        await see_the_fleet(day)
        await begin(day, "delivery")
        await decide_about_a_blocked_road(day)
        await lose_the_network(day)
        await stop_all_from_the_phone(day, free=19)
        await acknowledge_all(day, "ROUTE_BLOCKED")
        await end_the_day(day)


@pytest.mark.long
async def test_two_operators_work_all_day_without_a_reload(
    chromium: Browser, tmp_path: Path
) -> None:
    async with morning(chromium, tmp_path) as day:
        await see_the_fleet(day)
        for mission in ("sweep", "delivery"):
            await begin(day, mission)
        await begin_later(day)
        await decide_about_a_blocked_road(day)
        await decide_about_a_lost_vehicle(day)
        await answer_on_the_phone(day)
        await hand_over(day)
        await take_from_a_mission(day)
        await pause_and_go_on(day)
        await stop_one_and_replay_it(day)
        await lose_the_network(day)
        await kill(day.executive)
        with day.serve():
            await go_on_after_the_restart(day)
            await stop_all_from_the_phone(day, free=17)
            await acknowledge_all(day, "ROUTE_BLOCKED", "LINK_LOST", "A person is in the field")
            await end_the_day(day)


async def see_the_fleet(day: Day) -> None:
    """Twenty vehicles, each ready, and what each does by itself when its link is lost."""
    for each in (day.anna, day.otto):
        await each.go("Fleet")
        await expect(each.page.get_by_text("20 of 20")).to_be_visible()
        await expect(each.row("ugv01")).to_contain_text("OK")
        await each.look("fleet")
    anna = day.anna
    await anna.row("uav01").click()
    await expect(anna.commands()).to_contain_text("return_to_launch")
    await expect(anna.commands()).to_contain_text("ready")
    await anna.press(anna.bell())
    await anna.page.get_by_role("link", name="All alerts and their history").click()
    await anna.page.get_by_label("Messages of the browser").check()


async def press_start(day: Day, mission: str) -> Page:
    """On the page of the mission."""
    page = day.anna.page
    await day.anna.go("Missions")
    await page.get_by_role("link", name=mission, exact=True).click()
    await page.get_by_role("tab", name="Run", exact=True).click()
    await page.get_by_role("button", name="Start", exact=True).click()
    return page


async def begin(day: Day, mission: str) -> None:
    page = await press_start(day, mission)
    await page.wait_for_url("**/runs/*")
    day.run[mission] = page.url.rpartition("/")[2]


async def begin_later(day: Day) -> None:
    """One mission waits for the vehicle of another, one is scheduled."""
    anna, page = day.anna, await press_start(day, "collection")
    busy = page.get_by_role("dialog", name="Vehicles are busy")
    await expect(busy.get_by_role("row", name="ugv01")).to_contain_text(day.run["delivery"])
    await busy.get_by_role("button", name="Wait in the queue").click()
    scheduled = page.get_by_role("region", name="Scheduled")
    await expect(scheduled.get_by_role("row", name="collection waiting")).to_have_count(1)
    await scheduled.get_by_role("button", name="Schedule a mission").click()
    dialog = page.get_by_role("dialog", name="Schedule a mission")
    await dialog.get_by_label("Mission").select_option("night watch")
    await dialog.get_by_label("again and again").check()
    await dialog.get_by_label("Minute, hour").fill("* * * * *")
    await dialog.get_by_role("button", name="Schedule", exact=True).click()
    await expect(dialog).to_have_count(0)
    night = scheduled.get_by_role("row", name="night watch")
    run = night.get_by_role("link")
    await expect(run).to_have_count(1)
    day.run["night watch"] = await run.inner_text()
    await anna.look("scheduled")
    await night.get_by_role("button", name=re.compile("^Cancel")).click()
    asked = page.get_by_role("dialog", name=re.compile("^Cancel"))
    await asked.get_by_role("button", name="Cancel", exact=True).click()
    await expect(night).to_contain_text("cancelled by anna")


async def decide_about_a_blocked_road(day: Day) -> None:
    """Anna is shown a message of her browser, and decides from the alert; Otto's phone vibrates."""
    anna, otto = day.anna, day.otto
    await anna.page.wait_for_function("() => told.some(said => said.startsWith('m2pem: Error'))")
    await otto.page.wait_for_function("() => told.includes('vibrates')")
    await anna.to_alert("ROUTE_BLOCKED")
    await anna.look("incident")
    await anna.decide("Drive ugv01", "retry")


async def decide_about_a_lost_vehicle(day: Day) -> None:
    """Both see at once that a link is lost; another vehicle does what the lost one did."""
    anna, otto = day.anna, day.otto
    for each in (anna, otto):
        await each.press(each.bell())
        panel = each.page.get_by_role("dialog", name="Alerts")
        await expect(panel).to_contain_text(f"{LOST}: the link is lost")
        await each.look("lost")
        await each.page.keyboard.press("Escape")
    await anna.to_alert("Relay the radio")
    await anna.decide("Relay the radio", "retry_with", "uav03")
    await expect(anna.page.locator(".card", has_text="uav03")).to_contain_text("Relay the radio")


async def answer_on_the_phone(day: Day) -> None:
    """A detection interrupts the survey; how long the question is open is counted down."""
    otto = day.otto
    await otto.press(otto.page.get_by_role("link", name="question open"))
    question = otto.page.get_by_role("alertdialog", name="Question")
    await expect(question).to_contain_text("A person is in the field. Fly home?")
    await expect(question.get_by_role("timer")).to_contain_text("left")
    await otto.look("question")
    await otto.press(question.get_by_role("button", name="Fly home"))
    await expect(question).to_have_count(0)
    events = day.anna.page.get_by_role("region", name="Events")
    await expect(events).to_contain_text("answered by otto")


async def hand_over(day: Day) -> None:
    """Otto takes a vehicle, Anna asks for it, he gives it; she sends it to a place and back."""
    anna, otto = day.anna, day.otto
    await otto.go("Fleet")
    await otto.press(otto.row("uav05").get_by_role("rowheader"))
    await otto.press(otto.page.get_by_role("tab", name="Commands (1)"))
    await otto.command("Take over")
    card = anna.page.locator(".card", has_text="uav05")
    await expect(card).to_contain_text("with otto")
    await card.get_by_role("button", name="Ask for it", exact=True).click()
    asked = otto.page.get_by_role("alert").filter(has_text="anna asks you for uav05.")
    await expect(asked).to_contain_text(re.compile(r"stays in (1:00:00|\d\d:\d\d)"))
    await otto.look("asked")
    await otto.press(otto.page.get_by_role("button", name="Give it", exact=True))
    await expect(card).to_contain_text("with anna")
    await anna.go("Fleet")
    await anna.row("uav05").click()
    await anna.command("Goto…")
    await click_the_map(anna.page)
    await anna.command("Give the command")
    await expect(anna.row("uav05")).to_contain_text("goto")
    await anna.look("goto")
    await anna.command("Give back")
    await expect(anna.row("uav05")).not_to_contain_text("with you")


async def click_the_map(page: Page) -> None:
    box = await page.get_by_role("application", name="Map of the fleet").bounding_box()
    assert box is not None
    await page.mouse.click(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.25)


async def click_far_away(page: Page) -> None:
    """Kilometres away: no vehicle is there before all are on their way."""
    map_of_fleet = page.get_by_role("application", name="Map of the fleet")
    scale = map_of_fleet.locator(".leaflet-control-scale-line").first
    async with asyncio.timeout(TIMEOUT_MS / 1000):
        while "km" not in await scale.inner_text():
            await map_of_fleet.get_by_role("button", name="Zoom out").click()
    await click_the_map(page)


async def take_from_a_mission(day: Day) -> None:
    """What the mission does then is said before, and is an incident, which is decided."""
    anna = day.anna
    await anna.row("ugv03").click()
    await anna.command("Take over")
    confirm = anna.page.get_by_role("dialog", name="Take over ugv03")
    await expect(confirm).to_contain_text("an incident opens")
    await confirm.get_by_role("button", name="Take over", exact=True).click()
    await expect(anna.row("ugv03")).to_contain_text("with you")
    await anna.to_alert("TAKEN_OVER")
    await anna.decide("Drive ugv03", "skip")
    await anna.go("Fleet")
    await anna.row("ugv03").click()
    await anna.command("Give back")
    await expect(anna.row("ugv03")).to_contain_text("free")


async def with_the_runs(page: Page, runs: Sequence[str], deed: str, done: str) -> None:
    """Do the same with several runs, on the first page."""
    table = page.get_by_role("region", name="Runs")
    for run in runs:
        await table.get_by_role("checkbox", name=f"Select {run}", exact=True).check()
    await table.get_by_role("button", name=deed, exact=True).click()
    asked = page.get_by_role("dialog", name=re.compile(rf"\b{len(runs)} runs?\b"))
    await asked.get_by_role("button", name=deed, exact=True).click()
    await expect(asked.get_by_text(done, exact=True)).to_have_count(len(runs))
    await asked.get_by_role("button", name="Close").last.click()


async def pause_and_go_on(day: Day) -> None:
    anna, page = day.anna, day.anna.page
    runs = [day.run[mission] for mission in ("sweep", "delivery", "night watch")]
    await anna.go("Missions")
    paused = page.get_by_role("region", name="Runs").get_by_role("row", name="Paused")
    await with_the_runs(page, runs, "Pause", "paused")
    await expect(paused).to_have_count(len(runs))
    await with_the_runs(page, runs, "Resume", "resumed")
    await expect(paused).to_have_count(0)


async def stop_one_and_replay_it(day: Day) -> None:
    """What waited for its vehicle begins; the plots of what is over are seen meanwhile."""
    anna, page = day.anna, day.anna.page
    await with_the_runs(page, [day.run["delivery"]], "Stop", "stopped")
    queued = page.get_by_role("region", name="Scheduled").get_by_role("row", name="collection")
    run = queued.get_by_role("link")
    await expect(run).to_have_count(1)
    day.run["collection"] = await run.inner_text()
    await page.get_by_role("link", name=day.run["delivery"], exact=True).last.click()
    ended = page.get_by_role("dialog", name="The run has ended")
    await ended.get_by_role("button", name="Replay it").click()
    await expect(page.locator(".run-bar")).to_contain_text("Replay")
    await page.get_by_role("button", name="Plots", exact=True).click()
    plots = page.get_by_role("region", name="Plots")
    await expect(plots.locator("canvas").first).to_be_visible()
    await page.get_by_role("button", name="Play", exact=True).click()
    await expect(plots.get_by_role("row", name="ugv01")).to_contain_text("m/s")
    await anna.look("replay")


async def lose_the_network(day: Day) -> None:
    """What is shown is gray until the phone is connected again."""
    otto = day.otto
    day.proxy.stall()
    await expect(otto.page.get_by_text("Not connected to the executive")).to_be_visible()
    await expect(otto.page.locator(".fleet-page.stale")).to_have_count(1)
    day.proxy.heal()
    await expect(otto.page.locator(".link-open")).to_have_count(1)
    await expect(otto.page.locator(".fleet-page.stale")).to_have_count(0)


async def kill(executive: Served) -> None:
    executive.process.kill()
    await asyncio.to_thread(executive.process.wait)


async def go_on_after_the_restart(day: Day) -> None:
    anna, otto = day.anna, day.otto
    for each in (anna, otto):
        await expect(each.page.locator(".link-open")).to_have_count(1)
    await anna.go("Missions")
    goes_on = anna.page.get_by_role("region", name="Runs").get_by_role("row", name="Running")
    for mission in ("sweep", "collection", "night watch"):
        await expect(goes_on.filter(has_text=mission).first).to_be_visible()
    await anna.go("Fleet")
    await expect(anna.row(LOST)).to_contain_text("returned")


async def stop_all_from_the_phone(day: Day, free: int) -> None:
    """All vehicles that are free are sent somewhere: then each of the 20 has a command to stop."""
    anna, otto = day.anna, day.otto
    await anna.go("Fleet")
    await anna.page.get_by_role("button", name=f"Free {free}", exact=True).click()
    await anna.page.get_by_role("checkbox", name="Select all that are shown").check()
    await anna.command("Goto…")
    await click_far_away(anna.page)
    await anna.command("Give the command")
    confirm = anna.page.get_by_role("dialog", name=re.compile(r"^Goto: \d+ vehicles$"))
    await confirm.get_by_role("button", name="Give the command").click()
    await expect(confirm).to_have_count(0)
    await anna.page.get_by_role("button", name=re.compile("^Free")).click()
    await expect(anna.page.get_by_role("button", name="In runs 20", exact=True)).to_be_visible()
    await anna.look("all")
    stop = otto.page.locator("header button.stop")
    await press_twice(otto.page, stop.tap)
    await anna.go("Missions")
    runs = anna.page.get_by_role("region", name="Runs")
    await runs.get_by_role("combobox", name="Status").select_option("not ended")
    await expect(runs).to_contain_text("No run matches.")
    await expect(otto.page.locator(".undelivered")).to_have_count(0)
    await otto.look("stopped")
    (state,) = day.folder.glob("journal.db-sim-????????")
    await until_all_have_stopped(state)


async def until_all_have_stopped(state: Path) -> None:
    """Wait until the last command of each of the 20 has ended. `state`: what they did."""
    ends_s = asyncio.get_running_loop().time() + TIMEOUT_MS / 1000
    while True:
        last = {str(effect.resource): effect.kind for effect in recorded_effects(state)}
        moving = [name for name in VEHICLES if last.get(name) is not EffectKind.END]
        if not moving:
            return
        assert asyncio.get_running_loop().time() < ends_s, f"not stopped: {moving}"
        await asyncio.sleep(POLL_S)


async def acknowledge_all(day: Day, *shown: str) -> None:
    """No alert calls an operator any more; those of the day are `shown` as ended."""
    anna = day.anna
    await anna.press(anna.bell())
    await anna.page.get_by_role("link", name="All alerts and their history").click()
    await anna.look("alerts")
    button = re.compile("^Acknowledge ")
    acknowledge = anna.page.get_by_role("main").get_by_role("button", name=button)
    while await acknowledge.count():
        with suppress(PlaywrightTimeoutError):  # another one has moved there, or it has gone
            await acknowledge.first.click(timeout=AGAIN_MS)
    for each in (anna, day.otto):
        await expect(each.bell(0)).to_be_visible()
    ended = anna.page.get_by_role("region", name="Ended")
    for what in shown:
        await expect(ended.get_by_role("row", name=what).first).to_be_visible()


async def end_the_day(day: Day) -> None:
    """What was done is in the table of runs, all vehicles are free, and no page was reloaded."""
    anna, otto = day.anna, day.otto
    await anna.go("Missions")
    runs = anna.page.get_by_role("region", name="Runs")
    for mission, run in day.run.items():
        await runs.get_by_role("searchbox", name="Find a run").fill(mission)
        link = anna.page.get_by_role("link", name=run, exact=True)
        row = runs.get_by_role("row").filter(has=link)
        await expect(row).to_contain_text(mission)
        await expect(row).to_contain_text("Stopped")
    await anna.look("runs")
    await otto.press(otto.page.get_by_role("tab", name="Vehicles"))
    await expect(otto.page.get_by_role("button", name="Free 20", exact=True)).to_be_visible()
    for each in (anna, otto):
        await each.assert_never_reloaded()
