"""An exporter: writes runs of a journal for other programs (`m2pem export`)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, NamedTuple, Protocol

from m2pem.api.runs import RunSummary
from m2pem.engine.records import Record

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission


class ExportedRecord(NamedTuple):
    """A record. `at_us`: when it was decided, microseconds since the Unix epoch, by the executive's
    clock; `t_s`: mission time."""

    seq: int
    at_us: int
    t_s: float
    record: Record


@dataclass(frozen=True, slots=True)
class ExportedRun:
    """A run with all its records. `mission`, `fleet` None: they cannot be read any more. The faces
    of `fleet` are those of its file now, if that can be read.

    `journal`: its file, beside which other files about the run are; None: it is in memory.
    """

    summary: RunSummary
    records: Sequence[ExportedRecord]
    mission: "Mission | None" = None
    fleet: "Fleet | None" = None
    journal: Path | None = None

    def label(self, element: str) -> str:
        """Return the name of an element in the diagram; its id, if it has none."""
        found = self.mission.elements.get(element) if self.mission is not None else None
        return found.label if found is not None else element


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """What an operator asked for. `table`: `records` or `telemetry`, for formats that hold one.

    `recordings`: the folder with recordings of telemetry; None: the one that the fleet file names,
    or else the one beside the journal.
    """

    table: str = "records"
    recordings: Path | None = None


class Exporter(Protocol):
    """Constructed as `Exporter(output, options)`; the runs follow in the journal's order.

    If what is registered has `writes_folder = True`, `output` is the path of a folder, which the
    exporter makes.

    Methods raise `PluginError` for what cannot be exported, and `OSError`.
    """

    def __init__(self, output: BinaryIO, options: ExportOptions) -> None: ...

    def add(self, run: ExportedRun) -> None:
        """Write a run."""
        ...

    def close(self) -> Sequence[str]:
        """Write what is left; `output` stays open. Returns what people should know: what is
        missing, and why."""
        ...
