"""`m2pem answer`: one decision, for scripts."""

import click

from m2pem.cli.options import example, journal_option, run_argument
from m2pem.cli.steering import by_option, steer


@click.command(epilog=example("m2pem answer r1 p2 continue"))
@run_argument
@click.argument("prompt")
@click.argument("decision")
@journal_option
@by_option
def answer(run_id: str, prompt: str, decision: str, journal: str | None, by: str | None) -> None:
    """Answer a prompt of a run that is running on this host.

    The first answer wins; a later one ends with 1.
    """
    steer(journal, run_id, "answer", by, prompt=prompt, decision=decision)
