"""`m2pem switchover`: an executive leaves its runs to the one that stands by, and ends."""

import click

from m2pem.cli.options import example, journal_option, run_on_option
from m2pem.cli.run_control import by_option, found_elsewhere, journal_file


@click.command(epilog=example("m2pem switchover"))
@run_on_option
@journal_option
@by_option
def switchover(run_on: str | None, journal: str | None, by: str | None) -> None:
    """Have the executive of this host leave its runs to the one that stands by.

    Its vehicles go on with what they do, the standby takes the runs up, and the executive ends.
    Without a standby nothing changes.
    """
    import msgspec

    from m2pem.api.health import ExecutiveAddress
    from m2pem.api.operator import operator_name
    from m2pem.cli.notes import note
    from m2pem.control_socket.client import ask, choose_executive

    with found_elsewhere(journal):
        path = choose_executive(journal_file(journal), run_on)
    found = ask(path, "switch_over", by=by or operator_name())
    standby = msgspec.convert(found, ExecutiveAddress)
    note(f"{standby} takes over; process {path.stem} ends")
