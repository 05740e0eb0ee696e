"""/api/fleet: who has what, and commands outside of missions."""

from typing import Any

import pytest
from m2pem_plugin_web.access.requests import GIVEN, LATEST_S
from m2pem_plugin_web.access.roles import Role
from web_world import VEHICLE, Browser, Live, MakeWorld, World

from m2pem.api import RunStatus
from m2pem.api import records as r
from m2pem.bpmn.one_task import one_task
from m2pem.mission.behavior import BehaviorType

FAR = [38.2, -77.3]
PEOPLE = {"otto": Role.OPERATOR, "ben": Role.OPERATOR, "vera": Role.VIEWER}
COMMANDS: dict[str, dict[str, Any]] = {
    "preview": {},
    "take": {},
    "give-back": {},
    "execute": {"behavior": "hold"},
    "hold": {},
    "resume": {},
}


async def give(browser: Browser, command: str, *resources: str, **more: Any) -> list[Any]:
    """The results or effects of a command, for each resource."""
    body = {"resources": list(resources) or [VEHICLE], **more}
    answer = await browser.http.post(f"/api/fleet/{command}", json=body)
    assert answer.status_code == 200, answer.text
    found: list[Any] = next(iter(answer.json().values()))
    return found


async def goto(browser: Browser, **more: Any) -> Any:
    (result,) = await give(
        browser, "execute", behavior="goto", parameters={"target": FAR, "speed": "2 m/s"}, **more
    )
    return result


async def status(browser: Browser) -> Any:
    return (await browser.http.get("/api/fleet/status")).json()["resources"].get(VEHICLE)


async def until_commanded(browser: Browser, run: str) -> Any:
    """Wait until the page knows that a run commands the vehicle."""
    live = await browser.live()
    await live.watch(run)
    await live.until(lambda message: any((message.get("commands") or {}).values()))
    await live.close()
    return await status(browser)


async def until_status(live: Live, run: str, wanted: RunStatus) -> None:
    await live.until(
        lambda message: (
            message["type"] == "run"
            and (message["run"]["run"], message["run"]["status"]) == (run, wanted)
        )
    )


async def driving(here: World) -> str:
    """A mission that commands the vehicle."""
    mission, _ = one_task(BehaviorType.VEHICLE, VEHICLE, "goto", {"target": FAR, "speed": "2 m/s"})
    text = mission.replace(b'"ONE_TASK"', b'"Patrol"').replace(b'name="goto"', b'name="Drive"', 1)
    return await here.control.start(text, by="carla")


async def test_a_vehicle_is_commanded_held_and_goes_on(world: MakeWorld) -> None:
    async with world(users=PEOPLE) as here:
        otto = await here.browser("otto")
        assert await status(otto) is None
        result = await goto(otto)
        assert result["problem"] == ""
        run = result["run"]
        now = await until_commanded(otto, run)
        assert (now["run"], now["task"], now["direct"], now["by"]) == (run, "goto", True, "otto")
        assert not now["held"]
        live = await otto.live()
        await live.watch(run)
        for command, after in (("hold", RunStatus.PAUSED), ("resume", RunStatus.RUNNING)):
            assert await give(otto, command) == [{"resource": VEHICLE, "run": run, "problem": ""}]
            await until_status(live, run, after)
            assert (await status(otto))["held"] is (after is RunStatus.PAUSED)
        (refused,) = await give(otto, "resume")
        assert refused["problem"] == f"nothing that {VEHICLE} was commanded is held"
        # What was commanded before ends.
        (effect,) = await give(otto, "preview")
        assert effect["says"] == [f"goto ({run}), which you commanded, ends"]
        assert not effect["take"]
        next_run = (await goto(otto))["run"]
        assert (await here.control.wait(run)).status is RunStatus.STOPPED
        started = next(
            each.record
            for each in await here.control.records(next_run)
            if isinstance(each.record, r.RunStarted)
        )
        assert started.by == "otto"


async def test_what_a_mission_has_is_taken_over_only_when_that_is_confirmed(
    world: MakeWorld,
) -> None:
    async with world(users=PEOPLE) as here:
        otto = await here.browser("otto")
        run = await driving(here)
        now = await until_commanded(otto, run)
        assert (now["run"], now["task"], now["direct"]) == (run, "Drive", False)
        (effect,) = await give(otto, "preview")
        assert effect["take"]
        assert effect["says"] == [
            f"{run}: Drive ends with error TAKEN_OVER. TAKEN_OVER is not handled: "
            "the mission will fail"
        ]
        for refused in (await goto(otto), *(await give(otto, "hold"))):
            assert refused["problem"].startswith(f"run {run} has {VEHICLE}: take {VEHICLE} over")
        result = await goto(otto, take=True)
        assert result["problem"] == ""
        assert (await here.control.wait(run)).status is RunStatus.FAILED
        assert (await here.control.holders())[VEHICLE] == "otto"  # type: ignore[index]
        ben = await here.browser("ben")
        assert (await give(ben, "preview"))[0]["problem"] == (
            f"otto has {VEHICLE}: ask otto to give it back"
        )
        assert (await goto(ben, take=True))["problem"] == f"{VEHICLE} is with otto"
        assert (await give(otto, "give-back"))[0]["problem"] == ""


async def test_each_resource_has_its_own_result(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        known, unknown = await give(browser, "take", VEHICLE, "ugv9", VEHICLE)
        assert known == {"resource": VEHICLE, "run": "", "problem": ""}
        assert "the fleet has no 'ugv9'" in unknown["problem"]
        assert (await give(browser, "preview", "ugv9"))[0]["problem"] == "the fleet has no ugv9"
        (wrong,) = await give(browser, "execute", behavior="goto", parameters={"speed": "9 kg"})
        assert "target" in wrong["problem"]
        assert "speed" in wrong["problem"]
        assert await here.control.runs() == []


async def test_a_lost_vehicle_is_refused_with_the_reason(
    world: MakeWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with world() as here:
        browser = await here.browser()

        async def unavailable() -> dict[str, str]:
            return {VEHICLE: "lost: no telemetry for 3.0 s"}

        monkeypatch.setattr(here.control, "unavailable", unavailable)
        said = f"{VEHICLE} cannot be commanded now: lost: no telemetry for 3.0 s"
        assert (await give(browser, "preview"))[0]["problem"] == said
        assert (await goto(browser))["problem"] == said
        assert (await give(browser, "hold"))[0]["problem"] == said
        assert (await status(browser))["unavailable"] == "lost: no telemetry for 3.0 s"
        assert await here.control.runs() == []


@pytest.mark.parametrize("command", COMMANDS)
async def test_a_viewer_commands_nothing_and_a_late_command_is_refused(
    world: MakeWorld, command: str
) -> None:
    async with world(users=PEOPLE) as here:
        body = {"resources": [VEHICLE], **COMMANDS[command]}
        vera = await here.browser("vera")
        assert (await vera.http.get("/api/fleet/status")).status_code == 200
        answer = await vera.http.post(f"/api/fleet/{command}", json=body)
        assert answer.status_code == 403
        otto = await here.browser("otto")
        now = float((await (await otto.live()).watch(None))["now"])
        late = {GIVEN: f"{now - LATEST_S - 1:.3f}"}
        answer = await otto.http.post(f"/api/fleet/{command}", json=body, headers=late)
        assert answer.status_code == 409
        assert await here.control.runs() == []
        assert (await here.control.holders())[VEHICLE] == ""  # type: ignore[index]


async def test_the_fleet_says_hosts_and_failsafes(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        (vehicle,) = (await browser.http.get("/api/fleet")).json()["vehicles"]
        assert (vehicle["host"], vehicle["failsafe"]) == ("", "")
