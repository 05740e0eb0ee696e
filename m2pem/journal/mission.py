"""The mission of a run, as it was when the run began: from the journal, and from nothing else."""

from m2pem.bpmn import parse_mission
from m2pem.journal.base import RunHeader
from m2pem.mission.library import KeptLibrary
from m2pem.mission.mission import Mission


def mission_of(header: RunHeader) -> Mission:
    """Read a run's mission, and the files that it uses, again.

    What this m2pem refuses, and the one that began the run did not, is an error among the
    mission's `warnings`: a run goes on as it was begun.

    Raises:
        MissionError: nothing that could be executed can be read any more.
    """
    library = KeptLibrary(header.library)
    return parse_mission(header.mission, header.mission_name, library, accepted=True)
