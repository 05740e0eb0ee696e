"""`m2pem attach`: one more operator of a running executive, from another terminal."""

import asyncio

import click

from m2pem.cli.options import example, journal_option, ocu_option, optional_run_argument
from m2pem.cli.run_control import journal_file


@click.command(epilog=example("m2pem attach r1"))
@optional_run_argument
@journal_option
@ocu_option
def attach(run_id: str | None, journal: str | None, ocu_names: str | None) -> None:
    """Serve an operator of an executive that is running on this host.

    RUN selects the executive, when several write to the journal. All its operators see the same
    and may do the same; missions go on when this one leaves.
    """
    asyncio.run(_attach(run_id, journal, ocu_names))


async def _attach(run: str | None, journal_url: str | None, ocu_names: str | None) -> None:
    from m2pem.cli.ocus import Operators, chosen
    from m2pem.control_socket.client import find_executive
    from m2pem.control_socket.remote import RemoteControl
    from m2pem.executive.loading import load_source
    from m2pem.plugins import PluginManager

    path = journal_file(journal_url)
    plugins = PluginManager()
    operators = Operators(chosen(ocu_names, plugins), plugins)
    executive = await asyncio.to_thread(find_executive, path, run)
    async with RemoteControl(executive, load_source) as control:
        operators.begin(control, lambda: None)
        try:
            await operators.left()
        finally:
            await operators.end()
