"""`m2pem stop`: end a run, from wherever."""

import click

from m2pem.cli.options import example, journal_option, optional_run_argument
from m2pem.cli.steering import by_option, steer, steer_all


@click.command(epilog=example("m2pem stop r1 --reason 'people on the road'"))
@optional_run_argument
@click.option("--all", "every", is_flag=True, help="Every run of the journal that is running.")
@click.option("--reason", default="", help="Why, for the journal.")
@journal_option
@by_option
def stop(run_id: str | None, every: bool, reason: str, journal: str | None, by: str | None) -> None:
    """Stop a run that is running on this host, or all of them.

    Its vehicles are sent the command to stop, and its tokens end.
    """
    if every == (run_id is not None):
        raise click.UsageError("name a run to stop, or --all")
    if run_id is not None:
        steer(journal, run_id, "stop", by, reason=reason)
        return
    stopped = steer_all(journal, "stop_all", by, reason=reason)
    click.echo(f"stopped: {', '.join(stopped) or 'no run was running'}")
