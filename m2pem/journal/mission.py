"""The mission and the fleet of a run, as they were when the run began, read from the journal alone;
and the version of the mission that holds now.

It is apart from the rest of the journal, which needs no parser of BPMN.
"""

from dataclasses import replace

from m2pem.bpmn import parse_mission
from m2pem.engine.run import mission_of_revision
from m2pem.errors import JournalError
from m2pem.fleet.fleet import Fleet, restore, simulated_fleet
from m2pem.journal.base import Journal, RunHeader, RunInfo
from m2pem.mission.library import KeptLibrary
from m2pem.mission.mission import Mission


def mission_of(header: RunHeader) -> Mission:
    """Read a run's mission, and the files that it uses, again.

    Errors that this release finds and the release that began the run did not are among the
    mission's `warnings`: a run goes on as it was begun.

    Raises:
        MissionError: no executable mission can be read any more.
    """
    library = KeptLibrary(header.library)
    return parse_mission(header.mission, header.mission_name, library, accepted=True)


async def present_mission_of(journal: Journal, line: RunInfo) -> Mission:
    """Read the version of a run's mission that the last revision has brought, if there was any.

    Raises:
        MissionError: no executable mission can be read any more.
        JournalError: the run is not in the journal, or a revision of it is damaged.
    """
    revisions = [entry.revision for entry in await journal.revisions(line.run)]
    last = next(filter(None, reversed(revisions)), None)
    return mission_of(line.header) if last is None else mission_of_revision(last)


def fleet_of(header: RunHeader) -> Fleet:
    """Read the fleet that a run commands again. That of a simulated run is simulated, also where a
    journal of 0.1.0 keeps the fleet as it was before.

    Raises:
        JournalError: it is damaged, or of a newer version.
    """
    try:
        fleet = restore(header.fleet)
    except JournalError as error:
        raise JournalError(
            f"the fleet that the journal has of the run cannot be read: {error}. `m2pem journal "
            "check` says what is intact"
        ) from error
    if not header.simulated:
        return fleet
    return replace(simulated_fleet(fleet), approval_persons=fleet.approval_persons)
