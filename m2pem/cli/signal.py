"""`m2pem signal`: send a signal, for scripts."""

from typing import TYPE_CHECKING

import click

from m2pem.cli.options import example, journal_option, run_argument, signal_data_option
from m2pem.cli.steering import by_option, steer

if TYPE_CHECKING:
    from m2pem.mission.values import Value


@click.command(epilog=example("m2pem signal r1 'Stop driving'"))
@run_argument
@click.argument("signal_id", metavar="SIGNAL")
@signal_data_option
@journal_option
@by_option
def signal(
    run_id: str, signal_id: str, data: "dict[str, Value]", journal: str | None, by: str | None
) -> None:
    """Send a signal to a run that is running on this host.

    SIGNAL is its id, or its name.
    """
    steer(journal, run_id, "signal", by, id=signal_id, data=data)
