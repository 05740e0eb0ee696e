"""An operator written in Python: sends another route, then answers the prompt."""

import asyncio
import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from m2pem import load_fleet
from m2pem.api import MissionControl, OpenPrompt, RunSummary
from m2pem.api.clock import VirtualClock, run_virtual
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import simulated_fleet
from m2pem.journal import MemoryJournal
from m2pem.mission.values import Value
from m2pem.plugins import PluginManager

HERE = Path(__file__).parent
START_US = 1_767_225_600_000_000
"""2026-01-01T00:00:00Z"""


async def operate(control: MissionControl, route: Mapping[str, Value] | None) -> None:
    """Answer the first prompt; hand over a route (GeoJSON) before, if there is one."""
    async for notice in control.subscribe():
        if isinstance(notice, OpenPrompt):
            if route is not None:
                await control.set_geometry("route_alpha", route, run=notice.run, by="operator")
            await control.answer(notice.run, notice.prompt, "continue", by="operator")
            return


async def drive(route: Mapping[str, Value] | None, clock: VirtualClock) -> RunSummary:
    """Run the mission once, with the operator at its side."""
    fleet = simulated_fleet(load_fleet(HERE / "fleet.yaml"))
    async with Executive(fleet, MemoryJournal(), PluginManager(), clock) as executive:
        operator = asyncio.create_task(operate(executive.control, route))
        run = await executive.control.start(HERE / "mission.bpmn", by="hand_over.py")
        summary = await executive.control.wait(run)
        await operator
        return summary


def main() -> None:
    """Drive the planned route, then the one that the operator sends."""
    detour = json.loads((HERE / "detour.geojson").read_text(encoding="utf-8"))
    for name, route in (("planned", None), ("handed over", detour)):
        summary = run_virtual(partial(drive, route), START_US)
        seconds = ((summary.ended_us or 0) - summary.started_us) / 1_000_000
        print(f"route {name}: {summary.status} after {seconds:.1f} s")


if __name__ == "__main__":
    main()
