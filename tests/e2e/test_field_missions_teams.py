"""The field-test vignettes, run to each of their ends, with vehicles that tell where they are."""

import asyncio
from typing import Any

from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.engine import records as r
from m2pem.executive.executive import Executive
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import BehaviorState
from m2pem.mission.elements import EndEvent
from m2pem.plugins import PluginManager
from m2pem.rehearsal.answers import load_answers
from m2pem.rehearsal.scripted import ScriptedPlugins

from .test_field_missions import ANSWERS, Story, every_story_when_long, fleet, mission

START_US = 1_767_225_600_000_000
INNER = {"DETECTION", "ADVANCE"}
"""Called processes, whose end events are not ends of the vignette."""


class SeeingPlugins(PluginManager):
    """The built-in plugins, and what is told to observers."""

    def __init__(self, seen: list[r.Record]) -> None:
        super().__init__(block=("all",))
        self._seen = seen

    def records_committed(self, run_id: str, records: Any) -> None:
        self._seen.extend(records)


@every_story_when_long
def test_the_vignette_is_run_with_teams_made_of_single_vehicles(story: Story) -> None:
    seen: list[r.Record] = []
    answers = load_answers(ANSWERS / f"{story.answers}.yaml")

    async def main(clock: VirtualClock) -> tuple[Any, list[str]]:
        plugins = ScriptedPlugins(SeeingPlugins(seen), answers)
        executive = Executive(fleet(), MemoryJournal(), plugins, clock, on_records=answers.seen)
        async with executive:
            run = await executive.control.start(story.mission)
            act = answers.act(executive.control, run, clock, default_first_decision=True)
            acting = asyncio.create_task(act)
            summary = await executive.control.wait(run)
            acting.cancel()
            return summary, [
                effect.behavior for effect in executive.arbiters.by_name["sim"].effects
            ]

    summary, effects = run_virtual(main, START_US)
    assert summary.status is story.status, seen[-10:]
    ends = {
        node.id
        for process in mission(story.mission).processes
        for node in process.nodes
        if isinstance(node, EndEvent) and process.id not in INNER
    }
    entered = {each.element for each in seen if isinstance(each, r.TokenEntered)}
    assert ends & entered == set(story.ends)
    requested = [each.behavior for each in seen if isinstance(each, r.BehaviorRequested)]
    ended = {each.behavior: each for each in seen if isinstance(each, r.BehaviorEnded)}
    assert sorted(ended) == sorted(requested)
    for each in seen:
        if isinstance(each, r.BehaviorRequested) and each.type == "team":
            parts = {effect for effect in effects if effect.startswith(f"{each.behavior}.")}
            assert parts, f"{each.behavior} was done by its members, each for itself"
            assert ended[each.behavior].state is not BehaviorState.REJECTED, ended[each.behavior]
            assert each.behavior not in effects
