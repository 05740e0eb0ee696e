"""The options of `m2pem start` that make a mission start later (docs/scheduling.md)."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click

from m2pem.api.command_options import DurationOption
from m2pem.cli.completers import runs_and_entries

if TYPE_CHECKING:
    from m2pem.api.schedule import When

F = TypeVar("F", bound=Callable[..., Any])

FREE = "free"
"""What `--when` takes for: as soon as its vehicles are free."""


_OPTIONS = (
    click.option(
        "--when",
        metavar="TIME",
        help="Start it at a date and time (2026-05-01T08:00), at the next such time (08:00), or "
        "`free`: as soon as its vehicles are free.",
    ),
    click.option(
        "--cron", metavar="TEXT", help="Start it again and again: minute hour day month weekday."
    ),
    click.option(
        "--time-zone",
        metavar="ZONE",
        help="Of --when, --until and --cron, such as Europe/Berlin  [default: this host's]",
    ),
    click.option("--until", metavar="TIME", help="Start nothing after that date and time."),
    click.option(
        "--after",
        metavar="RUN",
        shell_complete=runs_and_entries,
        help="Start it when that run, or that of an entry (s1), has completed.",
    ),
    click.option(
        "--outcome",
        "outcomes",
        type=click.Choice(["completed", "terminated", "failed", "stopped"]),
        multiple=True,
        help="How the run of --after has to end. Can be given again.  [default: completed]",
    ),
    click.option(
        "--condition",
        metavar="EXPR",
        help="Start it when that holds, such as 'vehicle.battery > 0.9'.",
    ),
    click.option(
        "--of",
        "vehicles",
        metavar="VEHICLE",
        multiple=True,
        help="Of which vehicle. Can be given again.  [default: of all that the mission names]",
    ),
    click.option(
        "--held-for",
        "held_for_s",
        type=DurationOption(),
        metavar="DURATION",
        help="For how long the condition has to hold, such as '30 s'.",
    ),
    click.option(
        "--priority", type=int, help="What waits for the same vehicles: the greatest first."
    ),
    click.option(
        "--starting-deadline",
        "starting_deadline_s",
        type=DurationOption(),
        metavar="DURATION",
        help="How long after its time it may start; later, it is missed.  [default: 10 min; none "
        "without --when TIME or --cron]",
    ),
    click.option(
        "--missed",
        type=click.Choice(["skip", "run-once"]),
        help="What becomes of times that were missed.  [default: skip]",
    ),
    click.option(
        "--concurrency",
        type=click.Choice(["forbid", "allow"]),
        help="Whether a time may start a run while the last one goes on.  [default: forbid]",
    ),
)


def later_options(command: F) -> F:
    """Add the options to a command."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def scheduled_start(later: Mapping[str, Any]) -> "tuple[int, When | None]":
    """Return the priority, and when to start; None: now."""
    from m2pem.api.schedule import Concurrency, Missed, When

    given = {name: value for name, value in later.items() if value not in (None, ())}
    if not given:
        return 0, None
    for name in ("when", "cron", "time_zone", "until", "after", "condition"):
        if name in given and not given[name].strip():
            option = f"--{name.replace('_', '-')}"
            raise click.BadParameter(
                "it is empty: give a value, or leave it out", None, None, option
            )
    priority = given.pop("priority", 0)
    at = given.pop("when", "")
    if at and "cron" in given:
        raise click.UsageError("--when and --cron: give one of them, not both")
    fields: dict[str, Any] = {"at": "" if at == FREE else at, **given}
    if "missed" in fields:
        fields["missed"] = Missed(fields["missed"])
    if "concurrency" in fields:
        fields["concurrency"] = Concurrency(fields["concurrency"])
    return priority, When(**fields)
