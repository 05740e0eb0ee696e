"""`m2pem attach`: one more operator of a running executive, from another terminal."""

import asyncio

import click

from m2pem.cli.options import UnusableError, example, journal_option, ocu_option


@click.command(epilog=example("m2pem attach r1"))
@click.argument("run_id", metavar="[RUN]", required=False)
@journal_option
@ocu_option
def attach(run_id: str | None, journal: str | None, ocu_names: str | None) -> None:
    """Serve an operator of an executive that is running on this host.

    RUN selects the executive, when several write to the journal. All its operators see the same
    and may do the same; missions go on when this one leaves.
    """
    asyncio.run(_attach(run_id, journal, ocu_names))


async def _attach(run: str | None, journal_url: str | None, ocu_names: str | None) -> None:
    from m2pem.cli.journals import url_of
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.control_socket.client import find_executive
    from m2pem.control_socket.remote import RemoteControl
    from m2pem.journal import file_of
    from m2pem.plugins import PluginManager

    path = file_of(url_of(journal_url))
    if path is None:
        raise UnusableError("a journal in memory has no place where its executive could be found")
    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    async with RemoteControl(await asyncio.to_thread(find_executive, path, run)) as control:
        operators.begin(control, lambda: None)
        try:
            await operators.left()
        finally:
            await operators.end()
