"""Missions that start only when persons have approved exactly their content."""

from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import pytest

from m2pem.api.authoring import MissionFiles
from m2pem.api.clock import SystemClock
from m2pem.api.runs import Alert, RunId
from m2pem.api.schedule import When
from m2pem.errors import NotApprovedError, OperatorError
from m2pem.executive.executive import Executive
from m2pem.fleet.approval import file_digest
from m2pem.fleet.fleet import Fleet, simulated_fleet
from m2pem.journal import Journal, MemoryJournal
from m2pem.journal.base import RunHeader
from m2pem.mission.geometry import Point
from m2pem.mission.library import Source
from m2pem.plugins import PluginManager
from m2pem.scheduling.entry import EntryChange
from m2pem.testing import scenarios
from tests.executive.conftest import behavior, mission, sequence

PATROL = MissionFiles("patrol.bpmn", scenarios.question())
CHANGED = MissionFiles("patrol.bpmn", scenarios.question() + b"<!-- slower -->")
PLUGINS = PluginManager()
GATE = {"type": "Point", "coordinates": [-77.0, 38.001]}


def asking_fleet(persons: int = 2, role: str = "", **fields: Any) -> Fleet:
    """A simulated fleet whose file asks for approvals."""
    made = scenarios.fleet("sim", {"ugv1": {}}, geometries={"gate": Point((38.0, -77.0, None))})
    return replace(made, approval_persons=persons, approval_role=role, **fields)


@asynccontextmanager
async def executive(fleet: Fleet, journal: Journal | None = None):
    async with Executive(
        fleet, journal or MemoryJournal(), PLUGINS, SystemClock(20.0), speed=20.0
    ) as running:
        yield running


async def edited(control: Any, files: MissionFiles, by: str) -> None:
    for each in (files.source, *(source.data for source in files.library)):
        await control.note_edit(file_digest(each), by=by)


async def test_a_mission_starts_when_two_others_than_its_editor_have_approved_it() -> None:
    async with executive(asking_fleet()) as running:
        control = running.control
        await edited(control, PATROL, "anna")
        with pytest.raises(NotApprovedError, match="2 persons other than anna, who edited it"):
            await control.start(PATROL, by="carla")
        await control.approve(PATROL, by="bob@gcs1")
        with pytest.raises(NotApprovedError, match=r"bob@gcs1 .* 1 more person") as refused:
            await control.start(PATROL, by="carla", even_if_busy=True)
        assert refused.value.missing == 1
        state = await control.approve(PATROL, by="carla")
        assert state.may_start
        assert [each.by for each in state.approvals] == ["bob@gcs1", "carla"]
        assert await control.start(PATROL, by="anna") == "r1"


async def test_one_person_counts_once_and_nobody_approves_what_they_made() -> None:
    async with executive(asking_fleet(1)) as running:
        control = running.control
        await edited(control, PATROL, "anna")
        for same in ("anna", "Anna@gcs2"):
            with pytest.raises(OperatorError, match="edited it"):
                await control.approve(PATROL, by=same)
        with pytest.raises(OperatorError, match="needs the name"):
            await control.approve(PATROL)
        assert not (await control.approval(PATROL)).may_start
    async with executive(asking_fleet(2)) as running:
        control = running.control
        await edited(control, PATROL, "anna")
        for same in ("bob", "bob@gcs1", "BOB"):
            state = await control.approve(PATROL, by=same)
        assert len(state.approvals) == 1
        with pytest.raises(NotApprovedError):
            await control.start(PATROL)


async def test_one_more_must_approve_what_somebody_unknown_made() -> None:
    """One of those who approve may have."""
    async with executive(asking_fleet(1)) as running:
        control = running.control
        await control.approve(PATROL, by="bob")
        with pytest.raises(NotApprovedError, match="not known who edited"):
            await control.start(PATROL)
        await control.approve(PATROL, by="carla")
        await control.start(PATROL)


async def test_who_edits_a_file_that_it_calls_is_an_editor() -> None:
    called = Source("called.bpmn", b"<definitions/>", (("call", "P", ""),))
    files = replace(PATROL, library=(called,))
    async with executive(asking_fleet(1)) as running:
        control = running.control
        await control.note_edit(file_digest(PATROL.source), by="anna")
        await control.note_edit(file_digest(called.data), by="bob")
        approvals = running.starter.approvals
        state = await approvals.state(files.file, files.source, files.library)
        assert state.editors == ("anna", "bob")
        assert not state.editor_unknown


async def test_any_change_needs_approvals_anew_and_says_what_changed() -> None:
    async with executive(asking_fleet(1)) as running:
        control = running.control
        await edited(control, PATROL, "anna")
        await edited(control, CHANGED, "anna")
        await control.approve(PATROL, by="bob")
        with pytest.raises(NotApprovedError, match="before these changed: the mission file"):
            await control.start(CHANGED)
        looked_at = (await control.approval(PATROL)).digest
        with pytest.raises(OperatorError, match="changed since bob looked at it"):
            await control.approve(CHANGED, digest=looked_at, by="bob")
        await control.start(PATROL)


async def test_a_drawing_that_is_handed_over_anew_needs_approvals_anew() -> None:
    source = mission(
        sequence(
            (
                "T",
                behavior(
                    "T",
                    "goto",
                    "ugv1",
                    parameters='<m2pem:property name="target" value="gate"/>',
                ),
            )
        )
    )
    files = MissionFiles("goto.bpmn", source)
    async with executive(asking_fleet(1)) as running:
        control = running.control
        await edited(control, files, "anna")
        assert (await control.approve(files, by="bob")).may_start
        await control.set_geometry("elsewhere", GATE, by="otto")
        assert (await control.approval(files)).may_start
        await control.set_geometry("gate", GATE, by="otto")
        with pytest.raises(NotApprovedError, match="drawing gate"):
            await control.start(files)
        with pytest.raises(OperatorError, match="otto edited it"):
            await control.approve(files, by="otto")
        assert (await control.approve(files, by="bob")).may_start


async def test_an_approval_is_withdrawn_and_what_runs_goes_on() -> None:
    async with executive(asking_fleet(1)) as running:
        control = running.control
        await edited(control, PATROL, "anna")
        with pytest.raises(OperatorError, match="bob has not approved this content"):
            await control.withdraw_approval(PATROL, by="bob")
        await control.approve(PATROL, by="bob")
        run = await control.start(PATROL)
        assert not (await control.withdraw_approval(PATROL, by="bob@gcs2")).may_start
        with pytest.raises(NotApprovedError):
            await control.start(PATROL, even_if_busy=True)
        assert [each.run for each in await control.runs()] == [run]


async def test_only_operators_with_the_role_approve() -> None:
    fleet = asking_fleet(1, "reviewer", operators={"reviewer": ("bob",)})
    async with executive(fleet) as running:
        control = running.control
        await edited(control, PATROL, "anna")
        with pytest.raises(OperatorError, match="role 'reviewer' may: bob"):
            await control.approve(PATROL, by="carla")
        assert (await control.approve(PATROL, by="bob@gcs1")).may_start


async def test_the_journal_keeps_approvals_for_the_next_executive() -> None:
    journal = MemoryJournal()
    async with executive(asking_fleet(1), journal) as running:
        await edited(running.control, PATROL, "anna")
        await running.control.approve(PATROL, by="bob")
    async with executive(asking_fleet(1), journal) as running:
        await running.control.start(PATROL)
    other = replace(asking_fleet(1), name="another")
    async with executive(other, journal) as running:
        with pytest.raises(NotApprovedError):
            await running.control.start(PATROL)


async def test_what_is_not_asked_for_is_not_needed() -> None:
    for fleet in (asking_fleet(0), simulated_fleet(asking_fleet(2))):
        async with executive(fleet) as running:
            control = running.control
            with pytest.raises(OperatorError, match="asks for no approval"):
                await control.approve(PATROL, by="bob")
            assert (await control.preview_start(PATROL)).unapproved == ""
            await control.start(PATROL)


async def test_one_behavior_from_outside_of_a_mission_needs_none() -> None:
    async with executive(asking_fleet()) as running:
        control = running.control
        run = await control.execute_behavior("ugv1", "drive_stop", by="otto")
        await control.wait(run)


async def test_a_preview_of_a_start_says_who_must_approve() -> None:
    async with executive(asking_fleet()) as running:
        preview = await running.control.preview_start(PATROL)
        assert preview.refused
        assert "3 persons" in preview.unapproved


async def test_a_scheduled_mission_waits_for_approvals_and_starts_by_itself() -> None:
    fleet = asking_fleet(1, unattended=True, start_warning_s=0.0)
    async with executive(fleet) as running:
        control = running.control
        running.serve_schedule()
        await edited(control, PATROL, "anna")
        events = control.subscribe()
        await control.schedule(PATROL, when=When(), by="carla")
        with pytest.raises(NotApprovedError):
            await control.start_scheduled("s1", by="carla")

        async for _ in events:
            (entry,) = (await control.scheduled()).entries
            if "1 person other than anna" in entry.reason:
                break
        await control.approve(PATROL, by="bob")
        alerts = []
        async for event in events:
            if isinstance(event, Alert):
                alerts.append(event.text)
            if (await control.scheduled()).entries[0].run:
                break
        assert any("bob has approved patrol.bpmn" in each for each in alerts)


class SlowJournal(MemoryJournal):
    """A journal that lets others do something while it creates a run."""

    meanwhile: Callable[[], Awaitable[None]] | None = None

    async def create(self, header: RunHeader, started: EntryChange | None = None) -> RunId:
        run = await super().create(header, started)
        if self.meanwhile is not None:
            await self.meanwhile()
        return run


async def test_a_drawing_that_is_handed_over_as_the_mission_is_to_begin_keeps_it_from_that() -> (
    None
):
    target = '<m2pem:property name="target" value="gate"/>'
    source = mission(sequence(("T", behavior("T", "goto", "ugv1", parameters=target))))
    files, journal = MissionFiles("goto.bpmn", source), SlowJournal()
    async with executive(asking_fleet(1), journal) as running:
        control = running.control
        await edited(control, files, "anna")
        await control.approve(files, by="bob")
        journal.meanwhile = lambda: control.set_geometry("gate", GATE, by="otto")
        with pytest.raises(NotApprovedError, match="handed over anew as it was to begin"):
            await control.start(files)
        assert await control.runs() == []
        journal.meanwhile = None
        with pytest.raises(NotApprovedError, match="drawing gate"):
            await control.start(files)
