"""The operator control unit in a browser."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.api import OcuCapabilities
from m2pem_plugin_web.settings import Settings, read_settings

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from m2pem.api import ExecutiveAddress, MissionControl
    from m2pem_plugin_web.access.sign_in import Entry


class WebOcu:
    """Serves browsers until cancelled. `environment`: the variables of `settings`.

    It listens as soon as it is created, and answers during `serve`.

    Raises:
        PluginError: a variable has an invalid value, the address is in use, or a file with secrets
            is not private.
    """

    capabilities = OcuCapabilities(imports=("m2pem_plugin_web.app",), stands_by=True)

    @classmethod
    def page(cls) -> str:
        """Return the address of the page; "": it has any free port."""
        settings = read_settings()
        return settings.address(settings.port) if settings.port else ""

    @classmethod
    async def stand_by(cls, fleet: str, served_by: "Callable[[], ExecutiveAddress | None]") -> None:
        """See `StandbyOcu.stand_by`."""
        from m2pem_plugin_web import standby  # noqa: PLC0415

        await standby.serve(fleet, served_by, os.environ)

    def __init__(
        self, control: "MissionControl", *, environment: Mapping[str, str] = os.environ
    ) -> None:
        from m2pem_plugin_web.access import page_addresses  # noqa: PLC0415
        from m2pem_plugin_web.access.video_origins import origins_of  # noqa: PLC0415
        from m2pem_plugin_web.app import create_app, routers_of  # noqa: PLC0415
        from m2pem_plugin_web.live.hub import Hub  # noqa: PLC0415
        from m2pem_plugin_web.replay.replays import Replays  # noqa: PLC0415
        from m2pem_plugin_web.server import Server  # noqa: PLC0415
        from m2pem_plugin_web.services import services_of  # noqa: PLC0415
        from m2pem_plugin_web.tracks.pictures import pictures_beside  # noqa: PLC0415
        from m2pem_plugin_web.tracks.recorder import Recorder  # noqa: PLC0415
        from m2pem_plugin_web.tracks.stores import store_beside  # noqa: PLC0415

        settings = read_settings(environment)
        self._where = page_addresses.folder(environment)
        self._server = Server(settings)
        self.url = ""
        """The address of the page, with the valid token if there is one."""
        try:
            entry = self._entry(settings)
            self._replays = Replays(control)
            self.hub = Hub(control, self._replays.recordings)
            journal = control.journal_file()
            self._recorder = Recorder(
                control,
                self.hub.follower.views,
                self.hub.fleet,
                store_beside(journal),
                pictures_beside(journal),
                self.hub.detected,
            )
            self._services = services_of(control, settings.missions)

            def app() -> "ASGIApp":
                routers = routers_of(
                    self._services, settings, self.hub, entry, self._recorder, self._replays
                )
                videos = origins_of(control.fleet())
                slots, standbys = self._server.slots, self.hub.standbys
                return create_app(routers, entry, settings, slots, standbys, videos)

            self._make_app = app
        except BaseException:
            self._server.close()
            raise

    async def serve(self) -> None:
        """Serve browsers until cancelled."""
        import asyncio  # noqa: PLC0415

        import click  # noqa: PLC0415

        from m2pem_plugin_web.access import page_addresses  # noqa: PLC0415

        click.echo(f"m2pem: the page is at {self.url}", err=True)
        try:
            # In a thread: the import takes half a second, and STOP must not wait.
            app = await asyncio.to_thread(self._make_app)
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self.hub.run(), name="web: hub")
                tasks.create_task(self._recorder.run(), name="web: recorder")
                tasks.create_task(self._replays.run(), name="web: replays")
                tasks.create_task(self._server.serve(app), name="web: server")
        finally:
            self._server.close()
            page_addresses.withdraw(self._where, self._server.port)
            await self._services.close()

    def _entry(self, settings: Settings) -> "Entry":
        """Return the entry, and store the address for `m2pem web url`."""
        from m2pem.api.operator import operator_name  # noqa: PLC0415
        from m2pem_plugin_web.access import page_addresses  # noqa: PLC0415
        from m2pem_plugin_web.access.sign_in import Entry, owner_of  # noqa: PLC0415
        from m2pem_plugin_web.access.users import Users  # noqa: PLC0415

        where, port = self._where, self._server.port
        address = settings.address(port)

        def renewed(token: str) -> None:
            page = page_addresses.Page(os.getpid(), port, address, token)
            page_addresses.announce(where, page)
            self.url = page.url

        users = Users(settings.users) if settings.users is not None else None
        if users is not None:
            users.all()
            renewed("")
        kept: Path | None = page_addresses.sessions_of(where, port) if settings.port else None
        return Entry(
            port,
            secure=settings.scheme == "https",
            owner=owner_of(operator_name()) if users is None else None,
            users=users,
            kept=kept,
            renewed=renewed,
        )
