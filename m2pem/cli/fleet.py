"""`m2pem fleet`: who is there and can do what."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.completers import file_or
from m2pem.cli.options import as_json, example, format_option, journal_option
from m2pem.findings import lines

if TYPE_CHECKING:
    from m2pem.api.allocation import SharedSpaceState, WaitingTask
    from m2pem.executive.fleet_connections import FleetArbiters


@click.command(epilog=example("m2pem fleet fleet_configs/vignette1.yaml"))
@click.argument("fleet_file", metavar="FLEET", required=False, shell_complete=file_or())
@click.option("--schema", is_flag=True, help="Print the JSON Schema of fleet files instead.")
@click.option(
    "--running",
    is_flag=True,
    help="Ask the executives that serve the journal: who holds what, and which tasks wait.",
)
@journal_option
@format_option
def fleet(
    fleet_file: str | None, schema: bool, running: bool, journal: str | None, output: str
) -> None:
    """Show a fleet: who is there and can do what.

    Also the interrupted runs of the journal that have vehicles of the fleet.
    """
    if running:
        if fleet_file is not None or schema:
            raise click.UsageError("--running asks an executive, which has a fleet: name none")
        _show_running(journal, output)
        return
    if schema:
        from m2pem.fleet.fleet_schema import fleet_schema

        click.echo(as_json(fleet_schema()))
        return
    if fleet_file is None:
        raise click.UsageError("name a fleet file, or say --schema or --running")
    from m2pem.scripting.sources import DEFAULT_FLEET, arbiters_of

    if fleet_file == DEFAULT_FLEET:
        raise click.UsageError(f"{DEFAULT_FLEET!r} is made up from a mission; name a fleet file")
    from m2pem.cli.journals import interrupted_runs
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.plugins import PluginManager

    arbiters = arbiters_of(load_fleet(fleet_file), PluginManager())
    left = [
        run
        for run in asyncio.run(interrupted_runs(journal))
        if any(resource in arbiters.resources for resource in run.behaviors)
    ]
    if output == "json":
        click.echo(as_json({**_as_data(arbiters), "interrupted": left}))
    else:
        click.echo("\n\n".join([_as_text(arbiters), *(run.as_text() for run in left)]))


def _as_data(arbiters: "FleetArbiters") -> dict[str, Any]:
    from m2pem.mission.behavior import BehaviorType

    fleet = arbiters.fleet
    # What a vehicle can do in a team stands with the team.
    offers = {
        resource: [spec.name for spec in specs if spec.type is not BehaviorType.TEAM]
        for resource, specs in arbiters.catalogue().items()
    }
    return {
        "name": fleet.name,
        "file": fleet.file,
        "vehicles": {
            vehicle.id: {
                "domain": vehicle.domain.value,
                "arbiter": vehicle.arbiter,
                "manned": vehicle.manned,
                "behaviors": offers[vehicle.id],
            }
            for vehicle in fleet.vehicles.values()
        },
        "payloads": {
            payload.id: {
                "arbiter": payload.arbiter,
                "detector": payload.detector,
                "behaviors": offers[payload.id],
            }
            for payload in fleet.payloads.values()
        },
        "teams": {
            team.name: {
                "members": team.members,
                "lead": team.lead,
                "behaviors": [spec.name for spec in arbiters.graph.offers(team.name)],
            }
            for team in fleet.teams.values()
        },
        "geometries": {
            name: type(geometry).__name__.lower() for name, geometry in fleet.geometries.items()
        },
        "shared_space": {
            space.name: {
                "capacity": space.capacity,
                "domains": [domain.value for domain in space.domains],
                "on_conflict": space.on_conflict.value,
            }
            for space in fleet.shared_space.values()
        },
        "warnings": fleet.warnings,
    }


def _as_text(arbiters: "FleetArbiters") -> str:
    from m2pem.cli.table import table

    data = _as_data(arbiters)
    vehicles = [
        (
            name,
            f"{'manned ' if vehicle['manned'] else ''}{vehicle['domain']} vehicle",
            vehicle["arbiter"],
        )
        for name, vehicle in data["vehicles"].items()
    ]
    payloads = [
        (name, "detector" if payload["detector"] else "payload", payload["arbiter"])
        for name, payload in data["payloads"].items()
    ]
    parts = [
        f"{data['name']} ({data['file']})",
        table(("RESOURCE", "IS A", "ARBITER"), sorted([*vehicles, *payloads])),
    ]
    if data["teams"]:
        rows = [
            (name, team["lead"], ", ".join(team["members"])) for name, team in data["teams"].items()
        ]
        parts.append(table(("TEAM", "LEAD", "MEMBERS"), rows))
    if data["geometries"]:
        parts.append(table(("GEOMETRY", "IS A"), list(data["geometries"].items())))
    if data["shared_space"]:
        spaces = [
            (name, str(space["capacity"]), ", ".join(space["domains"]), space["on_conflict"])
            for name, space in data["shared_space"].items()
        ]
        parts.append(table(("SHARED SPACE", "CAPACITY", "DOMAINS", "ON CONFLICT"), spaces))
    offered: dict[str, list[str]] = {}
    for section in ("vehicles", "payloads", "teams"):
        for name, entry in data[section].items():
            for behavior in entry["behaviors"]:
                offered.setdefault(behavior, []).append(name)
    behaviors = [(name, ", ".join(who)) for name, who in sorted(offered.items())]
    parts.append(table(("BEHAVIOR", "OFFERED BY"), behaviors))
    if arbiters.fleet.warnings:
        parts.append("\n".join(lines(arbiters.fleet.warnings)))
    return "\n\n".join(parts)


@dataclass(frozen=True, slots=True)
class Holding:
    """What an executive says of its fleet. `holders`: by resource, "" if it is free. `unavailable`:
    why missions do not get some, or that one has returned and is held. `labels`: the task and run
    of each holder, by its id."""

    executive: str
    fleet: str
    holders: Mapping[str, str]
    waiting: "Sequence[WaitingTask]"
    shared_space: "Sequence[SharedSpaceState]"
    unavailable: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)

    def as_text(self) -> str:
        """Return it as text."""
        from m2pem.cli.table import table

        held = [(name, self._state(name, holder)) for name, holder in self.holders.items()]
        parts = [
            f"executive {self.executive} with fleet {self.fleet}",
            table(("RESOURCE", "HELD BY"), held),
        ]
        if self.shared_space:
            spaces = [
                (
                    each.name,
                    str(each.capacity),
                    ", ".join(map(str, each.holders)) or "free",
                    ", ".join(task.in_short() for task in each.waiting) or "-",
                )
                for each in self.shared_space
            ]
            parts.append(table(("SHARED SPACE", "CAPACITY", "TAKEN BY", "WAITING"), spaces))
        if self.waiting:
            rows = [
                (
                    each.run,
                    each.task,
                    f"{each.waited_s:.0f} s",
                    "-" if each.left_s is None else f"{each.left_s:.0f} s",
                    str(each.priority),
                    each.reason,
                )
                for each in self.waiting
            ]
            header = ("RUN", "TASK THAT WAITS", "WAITED", "LEFT", "PRIORITY", "FOR")
            parts.append(table(header, rows))
        return "\n\n".join(parts)

    def _state(self, name: str, holder: str) -> str:
        why = self.unavailable.get(name, "")
        if label := self.labels.get(holder):
            holder = f"{label} ({holder})"
        if holder and why and not why.startswith("with "):
            return f"{holder} ({why})"
        return holder or why or "free"


def _show_running(journal: str | None, output: str) -> None:
    """Print who holds what in the executives that serve a journal, and which tasks wait."""
    import msgspec

    from m2pem.api.allocation import SharedSpaceState, WaitingTask
    from m2pem.cli.run_control import executives_here
    from m2pem.control_socket.client import ask, fleet_name

    found = [
        Holding(
            socket.stem,
            fleet_name(socket),
            ask(socket, "holders"),
            msgspec.convert(ask(socket, "waiting"), list[WaitingTask]),
            msgspec.convert(ask(socket, "shared_space"), list[SharedSpaceState]),
            ask(socket, "unavailable"),
            ask(socket, "holder_labels"),
        )
        for socket in executives_here(journal)
    ]
    if output == "json":
        click.echo(as_json({"executives": found}))
    else:
        click.echo("\n\n".join(each.as_text() for each in found))
