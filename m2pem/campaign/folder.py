"""The folder of a campaign: its rows in Parquet files, a part for each chunk, and what it is of.

A part is there whole or not at all, so that a campaign that was interrupted goes on with what is
missing.
"""

import hashlib
import json
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from m2pem.campaign.runs import Order, Row
from m2pem.errors import OperatorError

MANIFEST = "campaign.json"
NEEDS = "campaigns are written with pyarrow: pip install 'm2pem[campaign]'"


def manifest_of(order: Order) -> dict[str, Any]:
    """Return what tells one campaign from another."""
    digest = hashlib.sha256(order.mission.source)
    for source in order.mission.library:
        digest.update(repr(source).encode())
    return {
        "m2pem": version("m2pem"),
        "mission": order.mission.file,
        "mission_sha256": digest.hexdigest(),
        "fleet_sha256": hashlib.sha256(order.fleet).hexdigest(),
        "variations_sha256": hashlib.sha256(order.variations).hexdigest(),
        "seed": order.seed,
        "process": order.process,
        "data": dict(order.data),
        "max_steps": order.max_steps,
        "required": list(order.required),
    }


class CampaignFolder:
    """The folder that a campaign is written to.

    Raises:
        OperatorError: pyarrow is not installed; the folder has another campaign, or one and
            `resume` was not asked for.
    """

    def __init__(self, folder: Path, order: Order, *, resume: bool) -> None:
        try:
            import pyarrow  # noqa: F401, PLC0415  # an extra
        except ModuleNotFoundError as error:
            raise OperatorError(NEEDS) from error
        self.folder = folder
        wanted = manifest_of(order)
        file = folder / MANIFEST
        if file.exists():
            if not resume:
                raise OperatorError(f"{folder} has a campaign: --resume goes on with it")
            kept = json.loads(file.read_text(encoding="utf-8"))
            other = [key for key, value in wanted.items() if kept.get(key) != value]
            if other:
                raise OperatorError(
                    f"{folder} has another campaign, which differs in: {', '.join(other)}"
                )
        else:
            folder.mkdir(parents=True, exist_ok=True)
            _write(file, json.dumps(wanted, indent=2).encode())
            _write(folder / "variations.yaml", order.variations)

    def rows(self) -> list[Row]:
        """Return the rows that are there, by their runs."""
        from pyarrow import parquet  # noqa: PLC0415  # an extra

        rows: dict[int, Row] = {}
        for part in sorted(self.folder.glob("part-*.parquet")):
            for row in parquet.read_table(part).to_pylist():
                rows[row["run"]] = {key: value for key, value in row.items() if value is not None}
        return [rows[run] for run in sorted(rows)]

    def add(self, rows: Sequence[Row]) -> None:
        """Add the rows of a chunk."""
        name = f"part-{min(row['run'] for row in rows):08d}.parquet"
        write_parquet(self.folder / name, rows)


def write_parquet(file: Path, rows: Iterable[Row]) -> None:
    """Write rows as a Parquet file. Columns that a row lacks are null."""
    import pyarrow as pa  # noqa: PLC0415  # an extra
    from pyarrow import parquet  # noqa: PLC0415  # an extra

    listed = list(rows)
    columns = dict.fromkeys(key for row in listed for key in row)
    table = pa.table({key: [row.get(key) for row in listed] for key in columns})
    part = file.with_suffix(".tmp")
    parquet.write_table(table, part, compression="zstd")
    part.replace(file)


def _write(file: Path, content: bytes) -> None:
    part = file.with_suffix(".tmp")
    part.write_bytes(content)
    part.replace(file)
