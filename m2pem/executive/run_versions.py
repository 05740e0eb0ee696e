"""The versions of its mission that a run has had, by its journal.

The command line reads them without an executive.
"""

from m2pem.api.authoring import MissionFiles
from m2pem.api.revision import RunVersion
from m2pem.engine.inputs import StartRun
from m2pem.errors import OperatorError
from m2pem.journal.base import Journal, RunInfo
from m2pem.mission.mission import SHORT, version_of_files


async def versions_of(
    journal: Journal, line: RunInfo, begun_with: MissionFiles | None = None
) -> list[tuple[RunVersion, MissionFiles]]:
    """Return each version of its mission that a run has had, in order, with its files.

    `begun_with`: the files of the first one; None: they are those of the line's header.
    """
    header = line.header
    first = begun_with or MissionFiles(header.mission_name, header.mission, header.library)
    began_us, by = line.started_us or header.created_us, await _who_began(journal, line.run)
    number = version_of_files(first.source, first.library)
    found = [(RunVersion(number, first.file, 1, began_us, by), first)]
    for entry in await journal.revisions(line.run):
        item = entry.revision
        if item is not None:
            files = MissionFiles(item.mission_name, item.mission, item.library)
            had = RunVersion(item.version, files.file, entry.seq, entry.at_us, item.by)
            found.append((had, files))
    return found


async def _who_began(journal: Journal, run: str) -> str:
    async for entry in journal.read(run):
        return entry.input.by if isinstance(entry.input, StartRun) else ""
    return ""


def files_of(found: list[tuple[RunVersion, MissionFiles]], run: str, version: str) -> MissionFiles:
    """Return the files of one of the versions that a run has had.

    Raises:
        OperatorError: it has not had that one.
    """
    for had, files in found:
        if had.version == version:
            return files
    those = ", ".join(had.version[:SHORT] for had, _ in found)
    raise OperatorError(f"{run} has not had version {version[:SHORT]!r}; it has had {those}")
