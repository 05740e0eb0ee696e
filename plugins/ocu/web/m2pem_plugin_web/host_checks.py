"""The checks of `m2pem doctor` for the page: its settings, its port, its files."""

import os
import socket
from collections.abc import Mapping, Sequence
from dataclasses import replace

from m2pem.api import HealthCheck, HealthStatus, listening_check
from m2pem.errors import PluginError
from m2pem_plugin_web.access.users import Users
from m2pem_plugin_web.settings import PORT, read_settings

NAME = "web page"


def check_host(environment: Mapping[str, str] = os.environ) -> Sequence[HealthCheck]:
    """Check that a page with the settings of `environment` can be served here."""
    try:
        settings = read_settings(environment)
        if settings.users is not None:
            Users(settings.users).all()
    except PluginError as error:
        remedy = "correct the setting, or serve without `--ocu web`"
        return [HealthCheck(NAME, HealthStatus.ERROR, str(error), remedy)]
    port = listening_check(NAME, settings.host, settings.port, socket.SOCK_STREAM)
    if port.status is HealthStatus.ERROR:
        # A host may serve other units alone; and while it serves the page, the port is in use.
        return [
            replace(
                port,
                status=HealthStatus.WARNING,
                remedy=f"{port.remedy}; {PORT}=0 takes any free port",
            )
        ]
    return [port]
