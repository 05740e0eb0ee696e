"""`m2pem schedule`: what starts when, and what it waits for; cancel it, hold it, release it."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.completers import entries_of_journal
from m2pem.cli.options import UnusableError, as_json, example, format_option, journal_option
from m2pem.cli.run_control import by_option, elsewhere, journal_file

if TYPE_CHECKING:
    from m2pem.api.schedule import Schedule, ScheduledMission
    from m2pem.journal import Journal
    from m2pem.scheduling.entry import ScheduleEntry

entry_argument = click.argument("entry", metavar="ENTRY", shell_complete=entries_of_journal)
optional_entry_argument = click.argument(
    "entry", metavar="[ENTRY]", required=False, shell_complete=entries_of_journal
)
all_option = click.option("--all", "every", is_flag=True, help="Those that are over, too.")


@click.group(invoke_without_command=True, epilog=example("m2pem schedule"))
@all_option
@journal_option
@format_option
@click.pass_context
def schedule(ctx: click.Context, every: bool, journal: str | None, output: str) -> None:
    """Show the missions that start later; cancel, hold or release them.

    `m2pem start MISSION --when ...` adds one. Without a word it is `m2pem schedule list`.
    """
    if ctx.invoked_subcommand is None:
        ctx.invoke(list_, every=every, journal=journal, output=output)
    elif every or journal or output != "text":
        raise click.UsageError(f"write the options after {ctx.invoked_subcommand}")


@schedule.command("list", epilog=example("m2pem schedule list --all"))
@all_option
@journal_option
@format_option
def list_(every: bool, journal: str | None, output: str) -> None:
    """List the entries: when each starts next, and what it waits for."""
    from m2pem.cli.table import table

    found = _schedules(journal)
    if output == "json":
        click.echo(as_json(found))
        return
    for hold in dict.fromkeys(each.hold for each in found if each.hold):
        click.echo(f"the schedule is {hold}; `m2pem schedule release` lets it go on")
    shown = [entry for each in found for entry in each.entries if every or not entry.status.over]
    if not shown:
        click.echo("nothing is scheduled")
        return
    header = ("ENTRY", "STATUS", "NEXT", "PRIORITY", "LAST RUN", "MISSION", "WHEN", "REASON")
    click.echo(table(header, [_row(entry) for entry in shown]))
    if not all(each.served for each in found):
        serves = elsewhere(journal) or "no executive serves this schedule now: `m2pem serve` does"
        click.echo(serves, err=True)


def _row(entry: "ScheduledMission") -> tuple[str, ...]:
    from m2pem.api.schedule import time_in

    next_us = entry.starts_us or entry.next_us
    return (
        entry.entry,
        entry.status.value,
        "-" if next_us is None or entry.status.over else time_in(next_us, entry.when.time_zone),
        str(entry.priority),
        entry.run or "-",
        entry.mission,
        entry.when_text,
        entry.reason.partition("\n")[0],
    )


@schedule.command(epilog=example("m2pem schedule show s1"))
@entry_argument
@journal_option
@format_option
def show(entry: str, journal: str | None, output: str) -> None:
    """Show an entry, with what became of its last times."""
    from m2pem.api.schedule import time_in

    found = _find(journal, entry)
    if output == "json":
        click.echo(as_json(found))
        return
    click.echo(str(found))
    zone = found.when.time_zone
    for settled in found.times:
        what = f"started {settled.run}" if settled.run else settled.settlement.value
        many = f" ({settled.times} times)" if settled.times > 1 else ""
        why = f": {settled.text}" if settled.text else ""
        click.echo(f"  {time_in(settled.due_us, zone)}  {what}{many}{why}")


@schedule.command(epilog=example("m2pem schedule cancel s1"))
@entry_argument
@journal_option
@by_option
def cancel(entry: str, journal: str | None, by: str | None) -> None:
    """Cancel an entry: it starts nothing any more.

    A run that it has started goes on.
    """

    async def offline(kept: "Journal", name: str) -> None:
        from m2pem.scheduling.entry import EntryChange

        state = (await _active(kept, entry)).state
        await kept.change_entry(EntryChange(entry, state.cancelled(name)))

    _ask(journal, entry, "unschedule", by, offline, f"{entry} is cancelled")


@schedule.command(epilog=example("m2pem schedule start s1"))
@entry_argument
@journal_option
@by_option
def start(entry: str, journal: str | None, by: str | None) -> None:
    """Start the mission of an entry now, whatever it waits for, and print the id of the run.

    It is refused while it is held, or while its vehicles are not free.
    """
    from m2pem.api.operator import operator_name
    from m2pem.control_socket.client import LONG_TIMEOUT_S, ask

    _find(journal, entry)
    for path, found in _sockets(journal_file(journal)):
        if entry in {each.entry for each in found.entries}:
            params = {"entry": entry, "by": by or operator_name()}
            click.echo(ask(path, "start_scheduled", timeout_s=LONG_TIMEOUT_S, **params))
            return
    no_executive = f"no executive serves {entry} now: `m2pem serve` does"
    raise UnusableError(elsewhere(journal) or no_executive)


@schedule.command(epilog=example("m2pem schedule hold s1 --reason 'rain'"))
@optional_entry_argument
@click.option("--reason", default="", help="Why, for the journal.")
@journal_option
@by_option
def hold(entry: str | None, reason: str, journal: str | None, by: str | None) -> None:
    """Let an entry, or the whole schedule, start nothing until it is released."""
    from m2pem.errors import OperatorError

    async def offline(kept: "Journal", name: str) -> None:
        from m2pem.scheduling.entry import EntryChange, Hold

        made = Hold(name, reason, time.time_ns() // 1000)
        if entry is not None:
            state = (await _active(kept, entry)).state
            await kept.change_entry(EntryChange(entry, state.changed(hold=made)))
            return
        fleets = {each.plan.fleet for each in await kept.entries() if each.state.active}
        if not fleets:
            raise OperatorError("nothing is scheduled")
        for fleet in fleets:
            await kept.hold_schedule(fleet, made)

    what = entry or "the schedule"
    _ask(journal, entry, "hold_schedule", by, offline, f"{what} is held", reason=reason)


@schedule.command(epilog=example("m2pem schedule release"))
@optional_entry_argument
@journal_option
@by_option
def release(entry: str | None, journal: str | None, by: str | None) -> None:
    """Let an entry, or the whole schedule, start missions again."""
    from m2pem.errors import OperatorError

    async def offline(kept: "Journal", _: str) -> None:
        from m2pem.scheduling.entry import EntryChange

        if entry is not None:
            state = (await _active(kept, entry)).state
            if state.hold is None:
                raise OperatorError(f"{entry} is not held")
            await kept.change_entry(EntryChange(entry, state.changed(hold=None)))
            return
        fleets = {each.plan.fleet for each in await kept.entries()}
        held = [fleet for fleet in fleets if await kept.schedule_hold(fleet) is not None]
        if not held:
            raise OperatorError("the schedule is not held")
        for fleet in held:
            await kept.hold_schedule(fleet, None)

    what = entry or "the schedule"
    _ask(journal, entry, "release_schedule", by, offline, f"{what} is released")


# --- whom to ask ----------------------------------------------------------------------------------


def _sockets(journal: Path) -> "Iterator[tuple[Path, Schedule]]":
    """Yield the executives on a journal that serve a schedule, each with its schedule."""
    import msgspec

    from m2pem.api.schedule import Schedule
    from m2pem.control_socket.client import ask
    from m2pem.control_socket.paths import live_sockets

    for path in live_sockets(journal):
        found = msgspec.convert(ask(path, "scheduled"), Schedule)
        if found.served:
            yield path, found


def _schedules(url: str | None) -> "list[Schedule]":
    """The schedules of all executives on the journal; without one, what the journal has."""
    served = [found for _, found in _sockets(journal_file(url))]
    return served or [asyncio.run(_kept(url))]


async def _kept(url: str | None) -> "Schedule":
    from m2pem.api.schedule import Schedule
    from m2pem.cli.journals import journal_to_read
    from m2pem.executive.schedule_view import scheduled_mission
    from m2pem.executive.scheduled_start import Look

    async with journal_to_read(url) as journal:
        entries = await journal.entries()
        fleets = dict.fromkeys(each.plan.fleet for each in entries)
        holds = {fleet: await journal.schedule_hold(fleet) for fleet in fleets}
        now_us = time.time_ns() // 1000
        shown = []
        for each in entries:
            why = each.state.hold or holds[each.plan.fleet]
            held = str(why) if why is not None and each.state.active else ""
            shown.append(scheduled_mission(each, Look(), held, now_us))
        hold = next((str(each) for each in holds.values() if each is not None), "")
        return Schedule(tuple(shown), hold)


def _find(url: str | None, entry: str) -> "ScheduledMission":
    known = {each.entry: each for found in _schedules(url) for each in found.entries}
    if entry not in known:
        there = f"it has {', '.join(known)}" if known else "it is empty"
        raise UnusableError(f"the schedule has no entry {entry!r}; {there}")
    return known[entry]


def _ask(
    url: str | None,
    entry: str | None,
    method: str,
    by: str | None,
    offline: "Callable[[Journal, str], Awaitable[None]]",
    done: str,
    **params: Any,
) -> None:
    """Ask the executive that serves an entry (None: all that serve), else change the journal."""
    from m2pem.api.operator import operator_name
    from m2pem.cli.journals import existing_journal
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import ask
    from m2pem.errors import OperatorError

    name = by or operator_name()
    serving = list(_sockets(journal_file(url)))
    served = [
        path
        for path, found in serving
        if entry is None or entry in {each.entry for each in found.entries}
    ]
    if entry is None and method == "release_schedule":  # executives of other fleets hold nothing
        served = [path for path, found in serving if found.hold] or served
    for number, path in enumerate(served):
        try:
            ask(path, method, entry=entry, by=name, **params)
        except OperatorError:
            # An executive of the same fleet may have read in the journal what the one before did.
            if method != "release_schedule" or not number or ask(path, "scheduled")["hold"]:
                raise

    async def change() -> None:
        async with existing_journal(url) as journal:
            await offline(journal, name)

    if not served:
        asyncio.run(change())
    note(done)


async def _active(journal: "Journal", entry: str) -> "ScheduleEntry":
    from m2pem.errors import OperatorError

    for found in await journal.entries():
        if found.id == entry:
            if found.state.active:
                return found
            raise OperatorError(f"{entry} is {found.state.end}")
    raise UnusableError(f"the schedule has no entry {entry!r}")
