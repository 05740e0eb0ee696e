"""Where a run stands: what every journal keeps beside a run's entries, and checks them against."""

from dataclasses import dataclass, replace

from m2pem.engine.records import RunEnded, RunOutcome, RunPaused, RunResumed, RunStarted
from m2pem.errors import InternalError, StaleEpochError
from m2pem.journal.base import Entry, Loss, RunHeader, RunLine

_NOTED = frozenset({RunStarted, RunPaused, RunResumed, RunEnded})


@dataclass(frozen=True, slots=True)
class Standing:
    """A run after its last entry. `pid`: the process that claimed it last.

    `hash`: of the last entry, or of the header before the first; None: from before the chain.
    """

    epoch: int
    pid: int
    started_us: int
    last_seq: int = 0
    paused: bool = False
    outcome: RunOutcome | None = None
    detail: str = ""
    ended_us: int | None = None
    hash: bytes | None = None

    def after(self, entry: Entry, hash_: bytes | None = None) -> "Standing":
        """Where the run stands with one more entry, whose hash is `hash_`.

        Raises:
            StaleEpochError: the run was claimed since.
            InternalError: the entry does not follow the last one.
        """
        if entry.epoch < self.epoch:
            raise StaleEpochError(
                f"{entry.run} was claimed by another executive since (epoch {self.epoch}; "
                f"this one has {entry.epoch}): this one must stop driving it"
            )
        if entry.epoch > self.epoch:
            raise InternalError(
                f"{entry.run}: an entry of epoch {entry.epoch}, which nobody has claimed; "
                f"the run is at epoch {self.epoch}"
            )
        if entry.seq != self.last_seq + 1:
            raise InternalError(
                f"{entry.run}: an entry that begins with record {entry.seq}; "
                f"{self.last_seq + 1} comes next"
            )
        if not entry.records:
            raise InternalError(f"{entry.run}: an entry without a record")
        standing = replace(self, last_seq=self.last_seq + len(entry.records), hash=hash_)
        for record in entry.records:
            if type(record) in _NOTED:
                standing = standing._noting(entry, record)
        return standing

    def _noting(self, entry: Entry, record: object) -> "Standing":
        match record:
            case RunStarted(started_us=started_us):
                return replace(self, started_us=started_us)
            case RunPaused():
                return replace(self, paused=True)
            case RunResumed():
                return replace(self, paused=False)
            case RunEnded(outcome=outcome, detail=detail):
                return replace(
                    self, paused=False, outcome=outcome, detail=detail, ended_us=entry.at_us
                )
        return self

    def claimed(self, pid: int) -> "Standing":
        """Where the run stands when process `pid` has taken it over."""
        return replace(self, epoch=self.epoch + 1, pid=pid)

    def line(self, run: str, header: RunHeader, driven: bool, loss: Loss | None = None) -> RunLine:
        """What `Journal.runs` says of it."""
        return RunLine(
            run=run,
            header=header,
            epoch=self.epoch,
            last_seq=self.last_seq,
            started_us=self.started_us,
            driven=driven,
            paused=self.paused,
            outcome=self.outcome,
            detail=self.detail,
            ended_us=self.ended_us,
            loss=loss,
        )
