"""A run of a mission: `MissionRun.receive` is the only door.

    run = MissionRun(mission, fleet, "r1")
    step = run.receive(StartRun("VIGNETTE1"), now_us)
    # write the step to the journal; when it is durable, carry out step.commands

Pure: no clock, no random, no I/O. The same inputs at the same times give the same records.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from m2pem.engine.apply import apply
from m2pem.engine.arming import next_timer
from m2pem.engine.commands import Command
from m2pem.engine.decide import decide
from m2pem.engine.inputs import Input, Revise
from m2pem.engine.outbox import commands_of, outstanding
from m2pem.engine.records import MissionRevised, Record
from m2pem.engine.state import RunState, RunStatus
from m2pem.engine.steps import Steps
from m2pem.errors import MissionError
from m2pem.fleet.fleet import Fleet
from m2pem.mission.library import KeptLibrary
from m2pem.mission.mission import Mission


def mission_of_revision(item: Revise) -> Mission:
    """Read the mission of a revision, as that of a run is read again (`m2pem.journal.mission`).

    Raises:
        MissionError: no executable mission can be read any more.
    """
    from m2pem.bpmn import parse_mission  # noqa: PLC0415  # slow to load, and few runs are revised

    return parse_mission(item.mission, item.mission_name, KeptLibrary(item.library), accepted=True)


@dataclass(frozen=True, slots=True)
class Step:
    """The result of an input. `seq`: number of the first record; `t_us`: mission time of all."""

    input: Input
    at_us: int
    t_us: int
    seq: int
    records: Sequence[Record]
    commands: Sequence[Command]


STEPS_AT_ONCE = 1_000
"""Steps after which a run that does not wait lets others run: STOP waits no longer. What is decided
again must be with as many: where a run yielded is in its records."""


class MissionRun:
    """A run: its state, and how inputs are decided."""

    def __init__(
        self, mission: Mission, fleet: Fleet | None, run: str, batch: int = STEPS_AT_ONCE
    ) -> None:
        """`mission`: the version with which the run begins, or has begun. `batch`: steps that one
        input may cause before the run yields (`Continue`)."""
        self.begun_with = mission
        self.state = RunState(run, mission)
        self._x = Steps(self.state, fleet, batch)

    def receive(self, item: Input, now_us: int) -> Step:
        """Decide an input that came at `now_us` (microseconds since the Unix epoch).

        Never raises because of a mission, an operator or a vehicle. An exception is a bug in
        m2pem; the state is not usable after it.
        """
        x = self._x
        self._read_version(item)
        seq = self.state.seq + 1
        t_us = 0 if self.state.status is RunStatus.NEW else self.state.mission_time_us(now_us)
        x.begin(now_us)
        decide(x, item)
        self.state.new_mission = None
        records = x.finish()
        return Step(item, now_us, t_us, seq, records, commands_of(self.state, records))

    def replay(self, records: Iterable[Record], item: Input | None = None) -> None:
        """Rebuild the state from journaled records, by applying them alone.

        `item`: the input that they were decided from, which has the files of a revision.

        Raises:
            MissionError: this release cannot read a version of the mission.
        """
        for record in records:
            if type(record) is MissionRevised:
                assert isinstance(item, Revise), "a revision is replayed with its input"
                self.state.new_mission = mission_of_revision(item)
            apply(self.state, record)

    def _read_version(self, item: Input) -> None:
        """Read the mission of a revision; one that cannot be read is refused when it is decided."""
        if isinstance(item, Revise):
            with suppress(MissionError):
                self.state.new_mission = mission_of_revision(item)

    def outstanding(self) -> Sequence[Command]:
        """Return the commands of all that should be active, for an executive that claims the
        run."""
        return outstanding(self.state)

    @property
    def wants_continue(self) -> bool:
        """Whether steps are left over for a `Continue`."""
        return bool(self.state.yielded) and self.state.status is RunStatus.RUNNING

    @property
    def steps_done(self) -> int:
        """Number of elements executed since this object was made; a limit of rehearsals."""
        return self._x.steps_done

    @property
    def next_due_us(self) -> int | None:
        """Due time of the next timer (microseconds since the Unix epoch); None: no timer runs."""
        if self.state.status is not RunStatus.RUNNING:
            return None
        due = next_timer(self._x)
        if due is None:
            return None
        return due[0] + self.state.started_us + self.state.paused_total_us
