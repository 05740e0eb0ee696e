"""The mission of a run, as it was when the run began: from the journal, and from nothing else."""

from m2pem.journal.base import RunHeader
from m2pem.model.bpmn import parse_mission
from m2pem.model.library import KeptLibrary
from m2pem.model.mission import Mission


def mission_of(header: RunHeader) -> Mission:
    """Read a run's mission, and the files that it uses, again.

    Raises:
        MissionError: this m2pem refuses what the one that began the run did not.
    """
    return parse_mission(header.mission, header.mission_name, KeptLibrary(header.library))
