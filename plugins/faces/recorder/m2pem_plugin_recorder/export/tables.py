"""Tables: a row for each record, or for each state of a vehicle or payload, as CSV or Parquet."""

import csv
import io
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, BinaryIO, TypeAlias

import msgspec

from m2pem.api import (
    US_PER_S,
    ExportedRun,
    ExportOptions,
    PayloadState,
    Telemetry,
    VehicleState,
)
from m2pem.errors import PluginError
from m2pem_plugin_recorder.export.states import States, iso_time

Row: TypeAlias = dict[str, Any]


class Kind(StrEnum):
    """What a column holds. `TIME`: microseconds since the Unix epoch."""

    TEXT = "text"
    WHOLE = "whole"
    NUMBER = "number"
    FLAG = "flag"
    TIME = "time"


_TEXT, _WHOLE, _NUMBER, _FLAG, _TIME = Kind

RECORD_COLUMNS = {
    "run": _TEXT,
    "mission": _TEXT,
    "seq": _WHOLE,
    "time_utc": _TIME,
    "mission_time_s": _NUMBER,
    "record": _TEXT,
    "process": _TEXT,
    "element": _TEXT,
    "label": _TEXT,
    "scope": _WHOLE,
    "token": _WHOLE,
    "behavior": _TEXT,
    "name": _TEXT,
    "resources": _TEXT,
    "state": _TEXT,
    "outcome": _TEXT,
    "code": _TEXT,
    "reason": _TEXT,
    "prompt": _TEXT,
    "decision": _TEXT,
    "by": _TEXT,
    "key": _TEXT,
    "content": _TEXT,
}
"""`content`: the whole record as JSON."""

STATE_COLUMNS = {
    "run": _TEXT,
    "time_utc": _TIME,
    "kind": _TEXT,
    "resource": _TEXT,
    "latitude_deg": _NUMBER,
    "longitude_deg": _NUMBER,
    "altitude_m": _NUMBER,
    "altitude_above_home_m": _NUMBER,
    "velocity_east_m_s": _NUMBER,
    "velocity_north_m_s": _NUMBER,
    "velocity_up_m_s": _NUMBER,
    "roll_rad": _NUMBER,
    "pitch_rad": _NUMBER,
    "yaw_rad": _NUMBER,
    "battery_fraction": _NUMBER,
    "mode": _TEXT,
    "armed": _FLAG,
    "ready": _FLAG,
    "not_ready_reasons": _TEXT,
    "link": _TEXT,
    "behavior": _TEXT,
    "pan_rad": _NUMBER,
    "tilt_rad": _NUMBER,
    "zoom": _NUMBER,
    "detections": _TEXT,
}
"""`detections`: as JSON; most states have none."""

_FIELDS = (
    "process",
    "element",
    "scope",
    "token",
    "behavior",
    "name",
    "state",
    "outcome",
    "code",
    "reason",
    "prompt",
    "decision",
    "by",
    "key",
)

BATCH = 10_000
"""Rows of a row group of Parquet."""


def record_rows(run: ExportedRun) -> Iterator[Row]:
    """Yield a row for each record of a run."""
    for each in run.records:
        record = each.record
        row: Row = {
            "run": run.summary.run,
            "mission": run.summary.mission,
            "seq": each.seq,
            "time_utc": each.at_us,
            "mission_time_s": each.t_s,
            "record": type(record).__name__,
            "content": msgspec.json.encode(record).decode(),
        }
        row.update({name: getattr(record, name, None) for name in _FIELDS})
        if row["element"]:
            row["label"] = run.label(row["element"])
        row["resources"] = _listed(record)
        yield row


def _listed(record: object) -> str | None:
    resources = getattr(record, "resources", None)
    if resources is None:
        resource = getattr(record, "resource", None)
        return None if resource is None else str(resource)
    return " ".join(resources)


def state_rows(run: ExportedRun, states: States) -> Iterator[Row]:
    """Yield a row for each state of a vehicle or payload during a run."""
    for state in states.of(run):
        row = _state_row(state)
        if row is not None:
            yield {"run": run.summary.run, **row}


def _state_row(state: Telemetry) -> Row | None:
    match state:
        case VehicleState():
            place, velocity = state.position, state.velocity_enu_m_s or (None, None, None)
            return {
                "time_utc": state.time_us,
                "kind": "vehicle",
                "resource": state.resource,
                "latitude_deg": None if place is None else place.latitude_deg,
                "longitude_deg": None if place is None else place.longitude_deg,
                "altitude_m": None if place is None else place.altitude_m,
                "altitude_above_home_m": state.altitude_above_home_m,
                "velocity_east_m_s": velocity[0],
                "velocity_north_m_s": velocity[1],
                "velocity_up_m_s": velocity[2],
                "roll_rad": state.roll_rad,
                "pitch_rad": state.pitch_rad,
                "yaw_rad": state.yaw_rad,
                "battery_fraction": state.battery_fraction,
                "mode": state.mode,
                "armed": state.armed,
                "ready": state.ready,
                "not_ready_reasons": "; ".join(state.not_ready_reasons),
                "link": state.link.value,
                "behavior": state.behavior,
            }
        case PayloadState():
            found = msgspec.json.encode(state.detections).decode() if state.detections else None
            return {
                "time_utc": state.time_us,
                "kind": "payload",
                "resource": state.resource,
                "link": state.link.value,
                "behavior": state.behavior,
                "pan_rad": state.pan_rad,
                "tilt_rad": state.tilt_rad,
                "zoom": state.zoom,
                "detections": found,
            }
    return None


class _Table:
    """The rows that were asked for, and their columns."""

    def __init__(self, options: ExportOptions) -> None:
        self._states = States(options.recordings)
        self._has_states = options.table == "telemetry"
        self.columns = STATE_COLUMNS if self._has_states else RECORD_COLUMNS

    def rows(self, run: ExportedRun) -> Iterator[Row]:
        return state_rows(run, self._states) if self._has_states else record_rows(run)

    @property
    def remarks(self) -> Sequence[str]:
        return self._states.remarks


class CsvExporter:
    """CSV with a line of column names (RFC 4180), in UTF-8; empty: not known."""

    def __init__(self, output: BinaryIO, options: ExportOptions) -> None:
        self._table = _Table(options)
        self._text = io.TextIOWrapper(output, encoding="utf-8", newline="")
        self._writer = csv.DictWriter(self._text, list(self._table.columns))
        self._writer.writeheader()

    def add(self, run: ExportedRun) -> None:
        """Write the rows of a run."""
        for row in self._table.rows(run):
            row["time_utc"] = iso_time(row["time_utc"])
            self._writer.writerow(row)

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        self._text.detach()
        return self._table.remarks


class ParquetExporter:
    """Parquet, with types: times are timestamps in microseconds, UTC."""

    def __init__(self, output: BinaryIO, options: ExportOptions) -> None:
        try:
            import pyarrow as pa  # noqa: PLC0415  # an extra of this plugin
            from pyarrow import parquet  # noqa: PLC0415
        except ModuleNotFoundError as error:
            raise PluginError(
                "parquet needs pyarrow: pip install 'm2pem-plugin-recorder[parquet]'"
            ) from error
        types = {
            Kind.TEXT: pa.string(),
            Kind.WHOLE: pa.int64(),
            Kind.NUMBER: pa.float64(),
            Kind.FLAG: pa.bool_(),
            Kind.TIME: pa.timestamp("us", tz="UTC"),
        }
        self._table = _Table(options)
        self._schema = pa.schema(
            [(name, types[kind]) for name, kind in self._table.columns.items()]
        )
        self._batch = pa.RecordBatch
        self._writer = parquet.ParquetWriter(output, self._schema, compression="zstd")

    def add(self, run: ExportedRun) -> None:
        """Write the rows of a run."""
        rows: list[Row] = []
        for row in self._table.rows(run):
            row["time_utc"] = datetime.fromtimestamp(row["time_utc"] // US_PER_S, UTC).replace(
                microsecond=row["time_utc"] % US_PER_S
            )
            rows.append(row)
            if len(rows) >= BATCH:
                self._write(rows)
                rows = []
        self._write(rows)

    def _write(self, rows: list[Row]) -> None:
        if rows:
            self._writer.write_batch(self._batch.from_pylist(rows, schema=self._schema))

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        self._writer.close()
        return self._table.remarks
