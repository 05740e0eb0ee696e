"""`m2pem continue`: go on after a pause."""

import click

from m2pem.cli.options import example, journal_option, run_argument
from m2pem.cli.steering import by_option, steer


@click.command("continue", epilog=example("m2pem continue r1"))
@run_argument
@journal_option
@by_option
def continue_(run_id: str, journal: str | None, by: str | None) -> None:
    """Let a run on this host go on after a pause."""
    steer(journal, run_id, "resume", by)
