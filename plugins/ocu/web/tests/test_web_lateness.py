"""Commands that arrive later than they may."""

from typing import Any

import pytest
from m2pem_plugin_web.access.requests import GIVEN, LATEST_S
from web_world import VEHICLE, MakeWorld, World

from m2pem.api import OpenPrompt, RunStatus


async def clock(world: World) -> float:
    """The executive's clock, as a page knows it from its stream."""
    live = await (await world.browser()).live()
    return float((await live.watch(None))["now"])


async def test_a_late_command_is_refused_with_its_age(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        for age in (LATEST_S + 1, 90.0):
            await see_that_it_is_refused(here, prompt, age)


async def see_that_it_is_refused(here: World, prompt: OpenPrompt, age: float) -> None:
    browser = await here.browser()
    late = {GIVEN: f"{await clock(here) - age:.3f}"}
    path = f"/api/runs/{prompt.run}"
    commands: list[tuple[str, Any]] = [
        (f"{path}/prompts/{prompt.prompt}", {"decision": prompt.decisions[0].value}),
        (f"{path}/pause", None),
        (f"/api/resources/{VEHICLE}/take", None),
        ("/api/signals", {"signal": "go"}),
    ]
    for address, body in commands:
        answer = await browser.http.post(address, json=body, headers=late)
        assert answer.status_code == 409, address
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.json()["age_s"] == pytest.approx(age, abs=5)
        assert f"given {answer.json()['age_s']} s before it arrived" in answer.json()["detail"]
    assert [each.prompt for each in here.control.prompts()] == [prompt.prompt]
    assert (await browser.http.get("/api/resources")).json()["holders"] == {VEHICLE: ""}


async def test_a_command_of_just_now_is_carried_out(world: MakeWorld) -> None:
    async with world() as here:
        prompt = await here.asked()
        browser = await here.browser()
        given = {GIVEN: f"{await clock(here):.3f}"}
        answer = await browser.http.post(f"/api/runs/{prompt.run}/pause", headers=given)
        assert answer.status_code == 204


@pytest.mark.parametrize("single", [True, False])
async def test_a_late_stop_is_carried_out_and_said_to_be_late(
    world: MakeWorld, single: bool
) -> None:
    async with world() as here:
        prompt = await here.asked()
        browser = await here.browser()
        live = await browser.live()
        now = (await live.watch(None))["now"]
        path = f"/api/runs/{prompt.run}/stop" if single else "/api/stop-all"
        late = {GIVEN: f"{now - 60:.3f}"}
        assert (await browser.http.post(path, json={"reason": "x"}, headers=late)).is_success
        summary = await here.control.wait(prompt.run)
        assert summary.status is RunStatus.STOPPED
        assert summary.detail.startswith("x (given 6")
        said = await live.until(lambda message: message["type"] == "fault")
        assert "s before it arrived; it is carried out" in said["text"]


async def test_a_clock_that_is_none_refuses_commands_but_no_stop(world: MakeWorld) -> None:
    async with world() as here:
        browser = await here.browser()
        for given in ("nan", "inf", "soon", "1e99"):
            prompt = await here.asked()
            said = {GIVEN: given}
            answer = await browser.http.post(f"/api/runs/{prompt.run}/pause", headers=said)
            assert answer.status_code == (409 if given == "1e99" else 400), given
            stopped = await browser.http.post("/api/stop-all", json={}, headers=said)
            assert stopped.is_success, given
            assert (await here.control.wait(prompt.run)).status is RunStatus.STOPPED, given
