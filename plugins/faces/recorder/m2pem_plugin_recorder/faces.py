"""The faces of this plugin. Their libraries are imported when a face is used, not before."""

from m2pem.api import FaceCapabilities, FaceSettings, MissionControl
from m2pem_plugin_recorder.settings import foxglove_settings, recorder_settings


class RecorderFace:
    """`recorder`: MCAP files of each run. See `m2pem.api.Face`."""

    capabilities = FaceCapabilities(imports=("m2pem_plugin_recorder.recorder",))

    def __init__(self, control: MissionControl, settings: FaceSettings) -> None:
        from m2pem_plugin_recorder.recorder import Recorder  # noqa: PLC0415

        self._recorder = Recorder(
            control, recorder_settings(settings, control.fleet(), control.journal_file())
        )

    async def serve(self) -> None:
        """Record until cancelled.

        Raises:
            PluginError: the disk takes no more.
        """
        await self._recorder.run()


class FoxgloveFace:
    """`foxglove`: a server for live viewers. See `m2pem.api.Face`."""

    capabilities = FaceCapabilities(imports=("m2pem_plugin_recorder.live",))

    def __init__(self, control: MissionControl, settings: FaceSettings) -> None:
        from m2pem_plugin_recorder.live import LiveServer  # noqa: PLC0415

        self._server = LiveServer(control, foxglove_settings(settings, control.fleet()))

    async def serve(self) -> None:
        """Serve until cancelled.

        Raises:
            PluginError: the port cannot be opened.
        """
        await self._server.run()
