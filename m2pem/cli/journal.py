"""`m2pem journal`: the state of a journal, a check, a backup, what is intact, a smaller file."""

import asyncio
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.completers import file_or
from m2pem.cli.options import UnusableError, as_json, example, format_option

if TYPE_CHECKING:
    from m2pem.journal import Journal, RunInfo
    from m2pem.journal.base import Deletion
    from m2pem.journal.inspection import Inspection

file_argument = click.argument("file", metavar="[FILE]", required=False, shell_complete=file_or())


@click.group(epilog=example("m2pem journal info"))
def journal() -> None:
    """Show the state of a journal, check it, back it up, salvage or compact it.

    FILE is a path or a URL, as of --journal of other commands; else your own journal.
    """


@journal.command(epilog=example("m2pem journal info"))
@file_argument
@format_option
def info(file: str | None, output: str) -> int:
    """Show the state of a journal: what it holds, whether it is whole, and who writes.

    Reads all entries and compares their hashes. Ends with 1 if something is lost or damaged.
    """
    from m2pem.journal.maintenance import LATEST_FORMAT, file_info

    if _is_postgres(file):
        return _show_database(str(file), output)
    path = _path(file)
    on_disk = file_info(path)
    content, executives = asyncio.run(_content(str(path))), _executives(path)
    if output == "json":
        found = {
            "path": str(path),
            "sizes": asdict(on_disk),
            "executives": executives,
            **content.as_data(),
        }
        click.echo(as_json(found))
    else:
        rows = {
            "path": str(path),
            "size": f"{_mb(on_disk.size)}, of which {_mb(on_disk.free)} are free; "
            f"log {_mb(on_disk.log)}",
            "format": f"{on_disk.format} (this m2pem writes {LATEST_FORMAT})",
            **({"origin": on_disk.origin} if on_disk.origin else {}),
            **content.as_text(),
            "written by": ", ".join(
                f"process {process} with fleet {fleet}" for process, fleet in executives.items()
            )
            or "no executive",
        }
        _show(rows)
    return 1 if content.problems else 0


def _show_database(url: str, output: str) -> int:
    from m2pem.journal import postgres_address
    from m2pem.journal.postgres_info import LATEST_FORMAT, database_info

    content = asyncio.run(_content(url))
    address = postgres_address(url)
    found = database_info(address)
    if output == "json":
        database = {"url": address.shown, "path": str(address.file), **asdict(found)}
        click.echo(as_json({**database, **content.as_data()}))
    else:
        rows = {
            "database": f"{address.shown}, PostgreSQL {found.server}",
            "path": f"{address.file} (marks, control sockets and tracks of this host)",
            "size": _mb(found.size),
            "format": f"{found.format} (this m2pem writes {LATEST_FORMAT})",
            **content.as_text(),
            "written by": "; ".join(found.executives) or "no executive",
        }
        _show(rows)
    return 1 if content.problems else 0


def _show(rows: dict[str, str]) -> None:
    for name, text in rows.items():
        click.echo(f"{name:<11} {text}")


def _is_postgres(file: str | None) -> bool:
    from m2pem.journal import is_postgres

    return is_postgres(file or "")


def _refuse_database(file: str | None, instead: str) -> None:
    """Refuse what only a file can be asked for.

    Raises:
        UnusableError: the journal is in PostgreSQL.
    """
    from m2pem.journal.postgres_address import without_password

    if _is_postgres(file):
        raise UnusableError(f"{without_password(str(file))} is in PostgreSQL: {instead}")


@journal.command(epilog=example("m2pem journal check"))
@file_argument
@format_option
def check(file: str | None, output: str) -> int:
    """Say what is intact in a journal, damaged or not.

    Changes nothing, also where nothing may be written, and while executives write. Ends with 1 if
    something is damaged or missing.
    """
    from m2pem.journal.inspection import inspected

    _refuse_database(
        file, "the server checks its own pages; `m2pem journal info` verifies all entries"
    )
    path = _path(file)
    with inspected(path) as (_, found):
        if output == "json":
            click.echo(as_json(_inspection_data(found)))
        else:
            for line in _inspection_lines(found):
                click.echo(line)
    return 0 if found.whole else 1


@journal.command(epilog=example("m2pem journal salvage damaged.db journal.db"))
@click.argument("source", metavar="SOURCE", shell_complete=file_or())
@click.argument("target", metavar="TARGET", type=click.Path(dir_okay=False, path_type=Path))
def salvage(source: str, target: Path) -> int:
    """Copy what is intact in a damaged journal to a new one.

    SOURCE is a path or a URL, and is not changed; TARGET is the file to make. A run that had not
    ended asks an operator when it is resumed; the schedule is held. Ends with 1 if something of
    SOURCE is damaged or missing. Refused while an executive writes to SOURCE.
    """
    from m2pem.api.operator import operator_name
    from m2pem.errors import OperatorError
    from m2pem.journal import salvage as salvaging

    _refuse_database(
        source, "restore a backup (pg_restore), or export its runs: `m2pem runs --export`"
    )
    path = _path(source)
    if writing := [f"process {process}" for process in _executives(path)]:
        raise OperatorError(f"{', '.join(writing)} writes to {path}: end that first")
    found = salvaging.salvage(path, target, operator_name())
    for line in _inspection_lines(found):
        click.echo(line)
    click.echo(f"{'salvaged to':<11} {target}")
    return 0 if found.whole else 1


@journal.command(epilog=example("m2pem journal backup --to monday.db"))
@file_argument
@click.option(
    "--to",
    "copy",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="COPY",
    help="The file to make  [default: FILE with the time, beside it]",
)
def backup(file: str | None, copy: Path | None) -> int:
    """Copy a journal, also while executives write to it, and verify the copy.

    Prints the path of the copy. Ends with 1 if entries of it are lost or damaged; then they are in
    the journal, too.
    """
    from m2pem.cli.notes import progress_line, share
    from m2pem.journal.maintenance import back_up

    _refuse_database(
        file, "copy it with `pg_dump`, also while executives write (docs/journal.md#postgresql)"
    )
    path = _path(file)
    if copy is None:
        copy = path.with_name(f"{path.stem}-{datetime.now(UTC):%Y%m%d-%H%M%S}{path.suffix}")
    with progress_line() as show:
        back_up(
            path,
            copy,
            lambda remaining, total: show(lambda: share(total - remaining, total, "pages copied")),
        )
    content = asyncio.run(_content(str(copy)))
    for problem in content.problems:
        click.echo(f"m2pem: {problem}", err=True)
    click.echo(copy)
    return 1 if content.problems else 0


@journal.command(epilog=example("m2pem journal compact"))
@file_argument
def compact(file: str | None) -> None:
    """Give the space of deleted runs back to the disk.

    Refused while an executive writes to the journal. Needs as much free space as it takes.
    """
    from m2pem.errors import OperatorError
    from m2pem.journal import maintenance

    _refuse_database(file, "it gives space back by itself (autovacuum)")
    path = _path(file)
    if writing := [f"process {process}" for process in _executives(path)]:
        raise OperatorError(f"{', '.join(writing)} writes to {path}: end that first")
    if driven := [line.run for line in asyncio.run(_lines(path)) if line.driven]:
        raise OperatorError(f"a process that is alive drives {', '.join(driven)}: end that first")
    before = maintenance.file_info(path)
    maintenance.compact(path)
    after = maintenance.file_info(path)
    click.echo(
        f"{path}: {_mb(after.size)}; it was {_mb(before.size)}, and its log {_mb(before.log)}"
    )


@dataclass(slots=True)
class Content:
    """What a journal holds, and `problems`: what is lost or damaged in it."""

    identity: str
    lines: "list[RunInfo]"
    deletions: "list[Deletion]"
    entries: int = 0
    records: int = 0
    problems: list[str] = field(default_factory=list)

    @property
    def _counts(self) -> dict[str, int]:
        ended = sum(line.outcome is not None for line in self.lines)
        driven = sum(line.driven for line in self.lines)
        counts = {"ended": ended, "driven": driven}
        return {**counts, "interrupted": len(self.lines) - ended - driven}

    def as_data(self) -> dict[str, object]:
        """Return the content as JSON values."""
        return {
            "identity": self.identity,
            "runs": {**self._counts, "deleted": len(self.deletions)},
            "entries": self.entries,
            "records": self.records,
            "deletions": [asdict(each) for each in self.deletions],
            "problems": self.problems,
        }

    def as_text(self) -> dict[str, str]:
        """Return lines of text by their names."""
        counts = ", ".join(f"{count} {what}" for what, count in self._counts.items() if count)
        last = f"; {self.deletions[-1]}" if self.deletions else ""
        return {
            "identity": self.identity,
            "runs": f"{len(self.lines)}{f' ({counts})' if counts else ''}",
            "deleted": f"{len(self.deletions)}{last}",
            "records": f"{self.records:,} in {self.entries:,} entries",
            "integrity": "; ".join(self.problems) or "all entries are there and unchanged",
        }


def _inspection_data(found: "Inspection") -> dict[str, object]:
    """Return what is intact as JSON values."""
    return {
        "path": str(found.path),
        "identity": None if found.identity is None else str(found.identity),
        "whole": found.whole,
        "problems": found.problems,
        "runs": [
            {
                "run": each.run,
                "entries": each.entries,
                "records": each.position.last_seq,
                "unusable": each.unusable,
                "missing": each.missing,
                "problem": each.problem,
            }
            for each in found.runs
        ],
        "deleted": len(found.deletions),
        "schedule": {
            "entries": len(found.schedule),
            "damaged": found.lost_schedule,
            "held": {fleet: str(hold) for fleet, hold in found.holds.items()},
        },
    }


def _inspection_lines(found: "Inspection") -> list[str]:
    """Return what is intact as lines for people: a run that is whole is only counted."""
    wrong = [each for each in found.runs if each.problem]
    whole = len(found.runs) - len(wrong)
    entries = sum(each.entries for each in found.runs)
    records = sum(each.position.last_seq for each in found.runs)
    held = "".join(f"; {fleet} is {hold}" for fleet, hold in found.holds.items())
    damaged = f", {found.lost_schedule} damaged" if found.lost_schedule else ""
    rows = [
        ("path", str(found.path)),
        ("identity", str(found.identity or "unknown")),
        ("file, mark", "; ".join(found.problems) or "no error is found"),
        (
            "runs",
            f"{len(found.runs)} ({whole} whole, {len(wrong)} not)"
            if wrong
            else f"{whole}, all whole",
        ),
        ("intact", f"{records:,} records in {entries:,} entries"),
        ("schedule", f"{len(found.schedule)} entries{damaged}{held}"),
        *((each.run, each.problem) for each in wrong),
    ]
    return [f"{name:<11} {text}" for name, text in rows]


async def _content(url: str) -> Content:
    """Read all entries of a journal."""
    from m2pem.cli.journals import journal_to_read
    from m2pem.cli.notes import progress_line, share

    async with journal_to_read(url) as opened:
        lines = list(await opened.runs())
        content = Content(str(opened.identity), lines, list(await opened.deletions()))
        total = sum(line.last_seq for line in lines)
        with progress_line() as show:
            for line in lines:
                if line.loss is not None:
                    content.problems.append(f"{line.run}: {line.loss}")
                if not line.gone:
                    await _read(
                        opened,
                        line,
                        content,
                        lambda: show(lambda: share(content.records, total, "records read")),
                    )
    return content


async def _read(
    opened: "Journal", line: "RunInfo", content: Content, progress: Callable[[], None]
) -> None:
    from m2pem.errors import JournalError

    try:
        async for entry in opened.read(line.run):
            content.entries += 1
            content.records += len(entry.records)
            progress()
    except JournalError as error:
        content.problems.append(str(error))


async def _lines(path: Path) -> "list[RunInfo]":
    from m2pem.cli.journals import journal_to_read

    async with journal_to_read(str(path)) as opened:
        return list(await opened.runs())


def _executives(path: Path) -> dict[str, str]:
    """Return the process ids of executives that write to a journal, with their fleets' names."""
    from m2pem.control_socket.client import fleet_name
    from m2pem.control_socket.paths import live_sockets
    from m2pem.errors import M2pemError

    found: dict[str, str] = {}
    for executive in live_sockets(path):
        try:
            found[executive.stem] = fleet_name(executive)
        except M2pemError:  # it has just ended, or hangs; it may write all the same
            found[executive.stem] = "unknown"
    return found


def _path(file: str | None) -> Path:
    """Return the file of a journal.

    Raises:
        UnusableError: it is not there, or in memory.
    """
    from m2pem.cli.run_control import journal_file

    path = journal_file(file)
    if path.is_dir():
        raise UnusableError(f"{path} is a folder; name a file in it")
    if not path.exists():
        raise UnusableError(f"there is no journal {path}")
    return path


def _mb(size: int) -> str:
    return f"{size / 1_000_000:.1f} MB"
