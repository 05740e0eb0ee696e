"""The position of a run: what every journal keeps beside its entries, to check the next entry."""

from dataclasses import dataclass, replace

from m2pem.engine.records import RunEnded, RunOutcome, RunPaused, RunResumed, RunStarted
from m2pem.errors import InternalError, StaleEpochError
from m2pem.journal.base import Entry, Loss, RunHeader, RunInfo

_CHANGING = frozenset({RunStarted, RunPaused, RunResumed, RunEnded})


@dataclass(frozen=True, slots=True)
class RunPosition:
    """State of a run after its last entry. `pid`: the process that claimed it last.

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

    def after(self, entry: Entry, hash_: bytes | None = None) -> "RunPosition":
        """Return the position after one more entry, whose hash is `hash_`.

        Raises:
            StaleEpochError: the run was claimed since.
            InternalError: the entry does not follow the last one.
        """
        self.check_claim(entry.run, entry.epoch)
        if entry.epoch > self.epoch:
            raise InternalError(
                f"{entry.run}: an entry of epoch {entry.epoch}, which was never claimed; "
                f"the run is at epoch {self.epoch}"
            )
        if entry.seq != self.last_seq + 1:
            raise InternalError(
                f"{entry.run}: an entry that begins with record {entry.seq}; "
                f"{self.last_seq + 1} comes next"
            )
        if not entry.records:
            raise InternalError(f"{entry.run}: an entry without a record")
        position = replace(self, last_seq=self.last_seq + len(entry.records), hash=hash_)
        for record in entry.records:
            if type(record) in _CHANGING:
                position = position._with_record(entry, record)
        return position

    def check_claim(self, run: str, epoch: int) -> None:
        """Check that a claim of the run holds.

        Raises:
            StaleEpochError: the run was claimed since.
        """
        if epoch < self.epoch:
            raise StaleEpochError(
                f"{run} was claimed by another executive since (epoch {self.epoch}; this one has "
                f"{epoch}): this one must stop driving it"
            )

    def _with_record(self, entry: Entry, record: object) -> "RunPosition":
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

    def claimed(self, pid: int) -> "RunPosition":
        """Return the position after process `pid` has claimed the run."""
        return replace(self, epoch=self.epoch + 1, pid=pid)

    def info(self, run: str, header: RunHeader, driven: bool, loss: Loss | None = None) -> RunInfo:
        """Return what `Journal.runs` says of the run."""
        return RunInfo(
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
