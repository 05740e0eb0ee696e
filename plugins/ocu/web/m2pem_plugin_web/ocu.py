"""The web page as an operator control unit."""

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from m2pem_plugin_web.settings import read_settings

if TYPE_CHECKING:
    from m2pem.api import MissionControl


class WebOcu:
    """Serves browsers until cancelled. `environment`: the variables of `settings`.

    Raises:
        PluginError: a variable has a value that it may not have.
    """

    def __init__(
        self, control: "MissionControl", *, environment: Mapping[str, str] = os.environ
    ) -> None:
        self._control = control
        self._settings = read_settings(environment)
        self.url = ""
        """Where it is served; with a token, if one is needed. Empty before it serves."""

    async def serve(self) -> None:
        """Serve browsers until cancelled.

        Raises:
            PluginError: the address is taken, or is none of this machine.
        """
        import asyncio  # noqa: PLC0415  # starting up must be fast

        import click  # noqa: PLC0415

        from m2pem.api.operator import operator_name  # noqa: PLC0415
        from m2pem_plugin_web.access.entry import Entry, owner_of  # noqa: PLC0415
        from m2pem_plugin_web.app import create_app, routers_of  # noqa: PLC0415
        from m2pem_plugin_web.live.hub import Hub  # noqa: PLC0415
        from m2pem_plugin_web.server import listen, serve  # noqa: PLC0415

        settings = self._settings
        listener = listen(settings)
        host, port = listener.getsockname()[:2]
        owner = owner_of(operator_name()) if settings.users is None else None
        entry = Entry(port, secure=settings.scheme == "https", owner=owner)
        address = f"{settings.scheme}://{f'[{host}]' if ':' in host else host}:{port}/"
        self.url = f"{address}?token={entry.token.value}" if entry.token else address
        hub = Hub(self._control)
        app = create_app(routers_of(self._control, settings, hub, entry), entry)
        click.echo(f"m2pem: the page is at {self.url}", err=True)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(hub.run(), name="web: hub")
            tasks.create_task(serve(app, listener, settings), name="web: server")
