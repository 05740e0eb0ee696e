"""`m2pem stop`: end a run, from wherever."""

import click

from m2pem.cli.options import example, journal_option, run_argument
from m2pem.cli.steering import by_option, steer


@click.command(epilog=example("m2pem stop r1 --reason 'people on the road'"))
@run_argument
@click.option("--reason", default="", help="Why, for the journal.")
@journal_option
@by_option
def stop(run_id: str, reason: str, journal: str | None, by: str | None) -> None:
    """Stop a run that is running on this host.

    Its tokens end, and its vehicles are told to stop.
    """
    steer(journal, run_id, "stop", by, reason=reason)
