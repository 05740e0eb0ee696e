"""What a fleet file can say of the faces `recorder` and `foxglove`, under `faces:`."""

from dataclasses import dataclass
from pathlib import Path

from m2pem.api import FaceSettings, Fleet

MB = 1_000_000

RATE_HZ = 10.0
STATES_PER_S = 1000.0
"""The default rates: of a vehicle or payload, and of all together, for large fleets."""

FOLDER = "recordings"
"""The folder beside the journal: `journal.db-recordings`."""


@dataclass(frozen=True, slots=True)
class RecorderSettings:
    """How the recorder writes, and where.

    `rate_hz`: of telemetry, for each vehicle and payload. `ros`: also in ROS 2's schemas.
    `file_bytes`: after which a file is followed by another. `total_bytes`: beyond which the oldest
    files are deleted; None: none is. `min_free_bytes`: of the disk, below which recording stops.
    """

    folder: Path
    rate_hz: float = RATE_HZ
    ros: bool = True
    file_bytes: int = 1000 * MB
    total_bytes: int | None = None
    min_free_bytes: int = 500 * MB


def default_rate_hz(fleet: Fleet) -> float:
    """Return how often each vehicle and payload is recorded if the fleet file does not say."""
    resources = len(fleet.vehicles) + len(fleet.payloads)
    return min(RATE_HZ, STATES_PER_S / max(1, resources))


def folder_beside(journal: Path) -> Path:
    """Return the folder of the recordings of a journal's runs."""
    return journal.with_name(f"{journal.name}-{FOLDER}")


def folder_named(fleet: Fleet, name: object) -> Path | None:
    """Return the folder of the setting `folder` of a fleet file; None: it has none."""
    return Path(fleet.file).parent / Path(name).expanduser() if isinstance(name, str) else None


def recorder_settings(
    settings: FaceSettings, fleet: Fleet, journal: Path | None
) -> RecorderSettings:
    """Read the settings of `recorder`. `journal`: its file; None: it is in memory.

    Raises:
        PluginError: one of them is wrong.
    """
    known = ("folder", "rate_hz", "ros", "file_mb", "total_mb", "min_free_mb")
    settings.refuse_others(known)
    named = settings.text("folder", "") if "folder" in settings.values else None
    folder = folder_named(fleet, named) or (folder_beside(journal) if journal is not None else None)
    if folder is None:
        raise settings.error("folder", "it is missing: the journal is in memory, beside no file")
    total_mb = settings.whole("total_mb", 0, 1, 10**9) if "total_mb" in settings.values else None
    return RecorderSettings(
        folder,
        settings.number("rate_hz", default_rate_hz(fleet), 0.01, 1000.0),
        settings.flag("ros", True),
        settings.whole("file_mb", 1000, 1, 10**6) * MB,
        None if total_mb is None else total_mb * MB,
        settings.whole("min_free_mb", 500, 0, 10**7) * MB,
    )


@dataclass(frozen=True, slots=True)
class FoxgloveSettings:
    """Where viewers connect. `port` 0: one that is free. `backlog`: messages that wait for a
    viewer; beyond them its oldest are dropped."""

    host: str = "127.0.0.1"
    port: int = 8765
    rate_hz: float = RATE_HZ
    ros: bool = False
    backlog: int = 1024


def foxglove_settings(settings: FaceSettings, fleet: Fleet) -> FoxgloveSettings:
    """Read the settings of `foxglove`.

    Raises:
        PluginError: one of them is wrong.
    """
    settings.refuse_others(("host", "port", "rate_hz", "ros", "backlog"))
    return FoxgloveSettings(
        settings.text("host", "127.0.0.1"),
        settings.whole("port", 8765, 0, 65535),
        settings.number("rate_hz", default_rate_hz(fleet), 0.01, 1000.0),
        settings.flag("ros", False),
        settings.whole("backlog", 1024, 16, 1_000_000),
    )
