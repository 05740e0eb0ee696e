"""`m2pem operators`: who is present, and who asks whom for which vehicle."""

import click

from m2pem.cli.options import as_json, example, format_option, journal_option
from m2pem.cli.run_control import executives_here


@click.command(epilog=example("m2pem operators"))
@journal_option
@format_option
def operators(journal: str | None, output: str) -> None:
    """List the operators who are present, and who asks whom for what.

    Those of all executives of this host on the journal.
    """
    import msgspec

    from m2pem.api.description import printable
    from m2pem.api.people import OpenControlRequest, OperatorPresence
    from m2pem.control_socket.client import ask

    present: list[OperatorPresence] = []
    requests: list[OpenControlRequest] = []
    for socket in executives_here(journal):
        present += msgspec.convert(ask(socket, "operators"), list[OperatorPresence])
        requests += msgspec.convert(ask(socket, "control_requests"), list[OpenControlRequest])
    if output == "json":
        click.echo(as_json({"operators": present, "control_requests": requests}))
    else:
        lines = [printable(str(each)) for each in (*present, *requests)]
        click.echo("\n".join(lines) or "no operator is present")
