"""The face `mavlink`. To be registered it needs no MAVLink library."""

from m2pem.api import FaceCapabilities, FaceSettings, MissionControl, ThrownEvents
from m2pem_plugin_mavlink.face.settings import read_settings


class MavlinkFace:
    """Implements `m2pem.api.Face`. Its settings in a fleet file: docs/mavlink-face.md.

    Raises:
        PluginError: a setting is wrong; the text names it.
    """

    capabilities = FaceCapabilities(
        imports=("m2pem_plugin_mavlink.face.server", "pymavlink.dialects.v20.development")
    )

    def __init__(self, control: MissionControl, settings: FaceSettings) -> None:
        self._control = control
        self._settings = read_settings(settings, control.fleet())
        from m2pem_plugin_mavlink.face.event_settings import (  # noqa: PLC0415  # it needs pymavlink
            read_event_rules,
        )

        self._rules = read_event_rules(
            settings, self._settings, control.fleet(), simulated=control.simulated()
        )
        sent = [each.rule for each in self._rules.sent]
        self._thrown = ThrownEvents(control, sent) if sent else None

    async def serve(self) -> None:
        """Serve ground stations until cancelled.

        Raises:
            PluginError: an endpoint cannot be opened.
        """
        from m2pem_plugin_mavlink.face.server import FaceServer  # noqa: PLC0415  # it needs pymavlink

        await FaceServer(self._control, self._settings, self._rules, self._thrown).serve()
