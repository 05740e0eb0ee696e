"""Marks that say which vehicles may still do what a run has commanded that is over.

Such a run is not resumed, so that its records do not tell the next executive: it has ended, with a
vehicle out of reach, or it was deleted.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.parse import quote
from uuid import UUID

from m2pem.api.arbiter import BehaviorId
from m2pem.engine.run import MissionRun
from m2pem.executive.mark_files import MarkFiles
from m2pem.executive.recovery import replay
from m2pem.executive.returns import still_lost
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Journal, RunInfo
from m2pem.journal.mission import fleet_of, mission_of
from m2pem.mission.catalogue import ResourceId


@dataclass(frozen=True, slots=True)
class LostMark:
    """What a resource may still do. `native_ref`: as in reports. `epoch`: with which the run of the
    behavior was driven. `why`: it is not free."""

    behavior: BehaviorId
    native_ref: str | None
    epoch: int
    why: str


class LostMarks:
    """The marks of the resources of one fleet. `file`, `identity`: of the journal."""

    def __init__(self, file: Path | None, identity: UUID, fleet: Fleet) -> None:
        kind = "lost-simulated" if fleet.simulated else "lost"
        self._files = MarkFiles(file, identity, kind)
        self._fleet = fleet.name

    def put(self, resource: ResourceId, mark: LostMark) -> None:
        """Have a mark written; returns at once."""
        self._files.put(self._name(resource), asdict(mark))

    def remove(self, resource: ResourceId) -> None:
        """Have the mark of a resource removed, which has stopped; returns at once."""
        self._files.remove(self._name(resource))

    def get(self, resource: ResourceId) -> LostMark | None:
        """Return what a resource may still do; None: nothing is known of it."""
        found = self._files.get(self._name(resource))
        if found is None:
            return None
        ref = found.get("native_ref")
        return LostMark(
            str(found.get("behavior", "")),
            None if ref is None else str(ref),
            int(found.get("epoch", 0)),
            str(found.get("why", "")),
        )

    def files(self, resource: ResourceId) -> list[Path]:
        """Return the files that the mark of a resource has, if it is there."""
        return self._files.files(self._name(resource))

    async def close(self) -> None:
        """Let the marks be written."""
        await self._files.close()

    def _name(self, resource: ResourceId) -> str:
        return f"{quote(self._fleet, safe='')}-{quote(resource, safe='')}"


async def left_by(journal: Journal, line: RunInfo) -> tuple[Fleet, dict[ResourceId, LostMark]]:
    """Return what the vehicles of a run that has not ended may still do when it is deleted.

    Raises:
        M2pemError: its mission, its fleet or its records cannot be read.
    """
    fleet = fleet_of(line.header)
    run = MissionRun(mission_of(line.header), fleet, line.run)
    await replay(journal, run, None)
    commanded = {
        resource: (behavior.id, behavior.native_ref)
        for behavior in run.state.behaviors.values()
        for resource in behavior.resources
    }
    lost = {name: (was.behavior, was.native_ref) for name, was in still_lost(run.state).items()}
    deleted = f"run {line.run} was deleted before it had ended, when it did"
    return fleet, {
        ResourceId(name): LostMark(behavior, ref, line.epoch, f"{deleted} {behavior}")
        for name, (behavior, ref) in (lost | commanded).items()
    }
