"""`m2pem pause`: hold the vehicles of a run."""

import click

from m2pem.cli.options import example, journal_option, run_argument
from m2pem.cli.steering import by_option, steer


@click.command(epilog=example("m2pem pause r1"))
@run_argument
@journal_option
@by_option
def pause(run_id: str, journal: str | None, by: str | None) -> None:
    """Pause a run that is running on this host.

    Its vehicles hold, and its timers stand.
    """
    steer(journal, run_id, "pause", by)
