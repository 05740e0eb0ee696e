"""Incidents on an executive: what is held, what is refused, and who decides first."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.runs import IncidentPreview, IncidentVerdict, RunStatus
from m2pem.api.telemetry import LinkState
from m2pem.engine.inputs import BehaviorReported
from m2pem.engine.records import (
    BehaviorRequested,
    DataWritten,
    IncidentOpened,
    IncidentResolved,
)
from m2pem.errors import BusyError, InternalError, OperatorError
from m2pem.mission.catalogue import BehaviorState

from .conftest import World, behavior, fleet, flow, mission, question, sequence, task
from .test_emergency import StallingJournal, alerts
from .test_lost_resources import says
from .test_recovery import left_behind

FAILED, SUCCEEDED = BehaviorState.FAILED, BehaviorState.SUCCEEDED


def stopping(body: str) -> bytes:
    """A mission whose errors open incidents."""
    executable = 'isExecutable="true"'
    return mission(body.replace(executable, f'{executable} m2pem:onError="incident"'))


DRIVE = stopping(sequence(("Drive", behavior("Drive", "drive_stop", "ugv1"))))


WAITS = mission(sequence(("Go", task("Go", "requires='true' wait='PT9M'"))))


async def failed(world: World, source: bytes = DRIVE, code: str = "ROUTE_BLOCKED") -> str:
    """Start a mission, and let its first behavior fail."""
    run = await world.executive.control.start(source)
    await world.fake.until_called("start", f"{run}.b1")
    world.fake.report(f"{run}.b1", FAILED, code)
    while not world.executive.runner(run).run.state.incidents:
        await world.clock.sleep(0.01)
    return run


def test_what_failed_is_held_and_no_other_run_gets_it(play):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world)
        await world.fake.until_called("hold", "ugv1")
        (incident,) = await control.incidents()
        assert (incident.run, incident.element, incident.code) == (run, "Drive", "ROUTE_BLOCKED")
        assert incident.roles == {"driver": ("ugv1",)}
        assert (await control.holders())["ugv1"] == f"{run}.i1"
        labels = await control.holder_labels()
        assert labels[f"{run}.i1"] == f"the incident of Drive of {run}"
        with pytest.raises(BusyError, match=f"run {run} uses ugv1"):
            await control.start(DRIVE)
        other = await control.start(WAITS)
        while not (found := await control.waiting()):
            await world.clock.sleep(0.01)
        (waiting,) = found
        assert waiting.holders == {"ugv1": f"{run}.i1"}
        await control.resolve_incident(run, "i1", "skip", by="anna")
        await control.wait(run)
        await world.fake.until_called("start", f"{other}.b1")
        world.fake.report(f"{other}.b1", SUCCEEDED)
        await control.wait(other)
        return [each for each in world.seen if isinstance(each, IncidentResolved)]

    (resolved,) = play(story, "ugv1")
    assert (resolved.choice, resolved.by) == ("skip", "anna")


def test_a_retry_gets_its_vehicle_before_a_task_that_waits_for_it(play):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world)
        other = await control.start(WAITS)
        await control.resolve_incident(run, f"{run}.i1", "retry")
        await world.fake.until_called("start", f"{run}.b2")
        assert world.fake.count("start", f"{other}.b1") == 0
        world.fake.report(f"{run}.b2", SUCCEEDED)
        await world.fake.until_called("start", f"{other}.b1")
        world.fake.report(f"{other}.b1", SUCCEEDED)
        return (await control.wait(run)).status

    assert play(story, "ugv1") is RunStatus.COMPLETED


PAIR = stopping(
    sequence(
        (
            "Drive",
            task("Drive", "requires='true' store='first'").replace(
                "</m2pem:resources>",
                '<m2pem:role name="wing" requires="true" store="second"/></m2pem:resources>',
            ),
        )
    )
)


@pytest.mark.parametrize(
    ("roles", "again"),
    [
        ({"wing": ["ugv3"]}, ("ugv1", "ugv3")),
        ({"driver": ["ugv2"]}, ("ugv2", "ugv1")),
        ({"driver": ["ugv3"], "wing": ["ugv2"]}, ("ugv3", "ugv2")),
    ],
)
def test_of_roles_by_need_some_are_named_and_the_others_are_chosen_anew(
    play, roles: dict[str, list[str]], again: tuple[str, ...]
):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world, PAIR)
        (incident,) = await control.incidents()
        assert incident.resources == ("ugv1", "ugv2")
        await control.resolve_incident(run, "i1", "retry_with", roles=roles)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        await control.wait(run)
        return [each for each in world.seen if isinstance(each, BehaviorRequested)], world.seen

    (_, second), seen = play(story, "ugv1", "ugv2", "ugv3")
    assert second.resources == again
    written = {each.key: each.value for each in seen if isinstance(each, DataWritten)}
    assert (written["first"], written["second"]) == again


def test_of_roles_by_need_one_is_named_though_the_task_never_got_any(play):
    """Nothing was free, so no behavior has begun: what had the roles is not known."""

    async def story(world: World):
        control = world.executive.control
        for name in ("ugv1", "ugv2", "ugv3"):
            await control.take(name, by="anna")
        run = await control.start(PAIR)
        while not (found := await control.incidents()):
            await world.clock.sleep(0.01)
        assert found[0].code == "RESOURCE_UNAVAILABLE"
        for name in ("ugv3", "ugv2"):
            await control.give_back(name, by="anna")
        with pytest.raises(OperatorError, match="ugv1 is unavailable: with anna"):
            await control.resolve_incident(run, "i1", "retry_with", roles={"wing": ["ugv1"]})
        await control.resolve_incident(run, "i1", "retry_with", roles={"wing": ["ugv2"]})
        await world.fake.until_called("start", f"{run}.b1")
        world.fake.report(f"{run}.b1", SUCCEEDED)
        await control.wait(run)
        return [each.resources for each in world.seen if isinstance(each, BehaviorRequested)]

    assert play(story, "ugv1", "ugv2", "ugv3") == [("ugv3", "ugv2")]


def test_the_hold_goes_out_while_the_commit_is_stalled(play):
    journal = StallingJournal()

    async def story(world: World):
        run = await world.executive.control.start(DRIVE)
        await world.fake.until_called("start")
        journal.stall()
        world.fake.report(f"{run}.b1", FAILED)
        await world.fake.until_called("hold", "ugv1")
        assert journal.waiting.is_set()
        assert not any(isinstance(each, IncidentOpened) for each in world.seen)
        journal.works.set()
        while not any(isinstance(each, IncidentOpened) for each in world.seen):
            await world.clock.sleep(0.01)
        await world.executive.control.stop(run)
        return world.fake.count("hold")

    assert play(story, "ugv1", journal=journal) == 1


def test_a_lost_vehicle_cannot_be_held_and_operators_are_warned_at_once(play):
    async def story(world: World):
        control = world.executive.control
        warning = asyncio.create_task(alerts(world, "NOT_RECEIVED"))
        run = await control.start(DRIVE)
        await world.fake.until_called("start")
        says(world, LinkState.LOST)
        alert = await warning
        with pytest.raises(OperatorError, match="ugv1 is unavailable: lost"):
            await control.resolve_incident(run, "i1", "retry_with", roles={"driver": ["ugv1"]})
        await control.resolve_incident(run, "i1", "retry_with", roles={"driver": ["ugv2"]})
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", SUCCEEDED)
        return alert, (await control.wait(run)).status

    alert, status = play(story, "ugv1", "ugv2", watch_links=True)
    assert "ugv1 may not have received the hold" in alert.text
    assert "lost" in alert.text
    assert status is RunStatus.COMPLETED


@pytest.mark.parametrize(
    ("choice", "options", "said"),
    [
        ("retri", {}, "did you mean 'retry'"),
        ("move", {"to": "S"}, "cannot move to 'S'"),
        ("retry_with", {"roles": {"driver": ["ugv9"]}}, "the fleet has no 'ugv9'"),
        ("retry_with", {"roles": {"driver": ["ugv3"]}}, "ugv3 is held by r2.b1"),
        ("set_data", {}, "set_data needs data"),
    ],
)
def test_a_wrong_choice_is_refused_before_it_is_journaled(
    play, choice: str, options: dict[str, Any], said: str
):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world)
        other = await control.start(mission(sequence(("D", behavior("D", "drive_stop", "ugv3")))))
        await world.fake.until_called("start", f"{other}.b1")
        before = world.executive.runner(run).run.state.seq
        with pytest.raises(OperatorError) as refused:
            await control.resolve_incident(run, "i1", choice, **options)
        assert world.executive.runner(run).run.state.seq == before
        return str(refused.value)

    assert said in play(story, "ugv1", "ugv3")


def test_the_first_of_two_operators_wins_and_the_other_is_told(play):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world)
        both = await asyncio.gather(
            control.resolve_incident(run, "i1", "skip", by="anna"),
            control.resolve_incident(run, "i1", "end", by="ben"),
            return_exceptions=True,
        )
        return both, (await control.wait(run)).status

    (first, second), status = play(story, "ugv1")
    assert first is None
    assert "is not open" in str(second) or "has ended" in str(second)
    assert status is RunStatus.COMPLETED


def test_taking_a_vehicle_says_that_an_incident_opens(play):
    async def story(world: World):
        control = world.executive.control
        await control.start(DRIVE)
        await world.fake.until_called("start")
        return [str(each) for each in await control.preview_take("ugv1")]

    assert play(story, "ugv1") == ["r1: an incident opens, which asks what is done with Drive"]


SAYS = {"commander": ("anna", "cid@gcs1"), "pilot": ("otto",)}


def for_role(role: str) -> bytes:
    return DRIVE.replace(b" m2pem:onError", f' m2pem:incidentRole="{role}" m2pem:onError'.encode())


@pytest.mark.parametrize(
    ("source", "refused", "allowed"),
    [
        (DRIVE, ["otto", "ben@gcs1", "cid", ""], "anna@gcs2"),  # the fleet file says commander
        (for_role("commander"), ["otto", "cid@gcs2"], "cid@gcs1"),
        (for_role("pilot"), ["anna", "cid@gcs1"], "otto@gcs1"),
    ],
)
def test_only_operators_with_its_role_decide_about_an_incident(
    play, source: bytes, refused: list[str], allowed: str
):
    vehicles = replace(fleet("ugv1"), incident_role="commander", operators=SAYS)

    async def story(world: World):
        control = world.executive.control
        run = await failed(world, source)
        before = world.executive.runner(run).run.state.seq
        said = []
        for by in refused:
            with pytest.raises(OperatorError) as error:
                await control.resolve_incident(run, "i1", "skip", by=by)
            said.append(str(error.value))
        assert world.executive.runner(run).run.state.seq == before
        (incident,) = await control.incidents()
        assert str(incident).endswith(f"; for {incident.operator_role}")
        await control.preview_incident(run, "i1", "skip")  # whoever may look, may look
        await control.resolve_incident(run, "i1", "skip", by=allowed)
        return said, (await control.wait(run)).status

    said, status = play(story, fleet=vehicles)
    role = "pilot" if b"pilot" in source else "commander"
    for by, text in zip(refused, said, strict=True):
        assert text.startswith(f"r1.i1: only operators with the role '{role}' may: ")
        assert text.endswith(f"'{by}' is not" if by else "who asks gave no name")
    assert status is RunStatus.COMPLETED


def test_where_the_fleet_names_no_operators_all_decide(play):
    async def story(world: World):
        run = await failed(world, for_role("commander"))
        (incident,) = await world.executive.control.incidents()
        assert incident.operator_role == "commander"
        await world.executive.control.resolve_incident(run, "i1", "skip", by="ben")
        return (await world.executive.control.wait(run)).status

    assert play(story, "ugv1") is RunStatus.COMPLETED


def test_only_operators_with_its_role_answer_a_prompt(play):
    asking = question("Ask").replace("<m2pem:prompt>", '<m2pem:prompt role="pilot">')

    async def story(world: World):
        control = world.executive.control
        run = await control.start(mission(sequence(("Ask", asking))))
        (prompt,) = control.prompts()
        with pytest.raises(OperatorError, match=r"r1: p1: only .*'pilot' may: otto; 'anna' is not"):
            await control.answer(run, prompt.prompt, "yes", by="anna")
        await control.answer(run, prompt.prompt, "yes", by="otto@gcs1")
        return (await control.wait(run)).status

    vehicles = replace(fleet("ugv1"), operators=SAYS)
    assert play(story, fleet=vehicles) is RunStatus.COMPLETED


def test_stop_and_pause_work_with_an_open_incident(play):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world)
        await control.pause(run)
        await control.resolve_incident(run, "i1", "retry", by="anna")
        with pytest.raises(OperatorError, match="was resolved by anna"):
            await control.resolve_incident(run, "i1", "skip", by="ben")
        assert world.fake.count("start") == 1
        await control.resume(run)
        await world.fake.until_called("start", f"{run}.b2")
        world.fake.report(f"{run}.b2", FAILED)
        await world.fake.until_called("hold", times=2)
        await control.stop(run, by="anna")
        return (await control.wait(run)).status, await control.holders(), await control.incidents()

    status, holders, incidents = play(story, "ugv1")
    assert (status, holders, incidents) == (RunStatus.STOPPED, {"ugv1": ""}, [])


def test_an_open_incident_is_taken_up_after_a_restart(play):
    journal = left_behind(DRIVE, BehaviorReported("r1.b1", 1, FAILED, "ROUTE_BLOCKED"))

    async def story(world: World):
        control = world.executive.control
        await world.executive.resume("r1")
        await world.fake.until_called("hold", "ugv1")
        (incident,) = await control.incidents()
        assert (await control.holders())["ugv1"] == incident.incident == "r1.i1"
        await control.resolve_incident("r1", "i1", "retry", by="anna")
        await world.fake.until_called("start", "r1.b2")
        world.fake.report("r1.b2", SUCCEEDED)
        return (await control.wait("r1")).status

    assert play(story, "ugv1", journal=journal) is RunStatus.COMPLETED


def test_an_incident_is_not_an_idle_run_and_other_branches_go_on(play):
    both = stopping(
        '<process id="P" isExecutable="true"><startEvent id="S"/><parallelGateway id="F"/>'
        f"{behavior('Drive', 'drive_stop', 'ugv1')}{question('Ask')}{flow('S', 'F')}"
        f"{flow('F', 'Drive')}{flow('F', 'Ask')}</process>"
    )

    async def story(world: World):
        control = world.executive.control
        run = await failed(world, both)
        (prompt,) = control.prompts()
        await control.answer(run, prompt.prompt, "yes")
        await control.resolve_incident(run, "i1", "end", by="anna")
        return await control.wait(run)

    summary = play(story, "ugv1")
    assert summary.status is RunStatus.FAILED
    assert "error ROUTE_BLOCKED from Drive" in summary.detail


async def breaks_off(*_: object) -> IncidentPreview:
    raise InternalError("the worker broke off with status -9")


def test_an_exploration_that_breaks_off_is_not_known_and_keeps_no_operator_from_deciding(play):
    async def story(world: World):
        control = world.executive.control
        run = await failed(world)
        seen = await control.preview_incident(run, "i1", "retry")
        same = DRIVE.replace(b'"Drive"', b'"Drive" name="Go"')
        plan = await control.plan_revision(run, same)
        await control.revise(run, same, plan.plan)
        await control.resolve_incident(run, "i1", "retry")
        await world.fake.until_called("start", f"{run}.b2")
        return seen, plan.outlook

    not_known = IncidentPreview(
        IncidentVerdict.UNKNOWN, "its exploration broke off; the log of the executive says why"
    )
    assert play(story, "ugv1", foresee=breaks_off) == (not_known, not_known)
