"""Decides a run's inputs again: does this release, given the same, do the same?"""

from typing import Any

from m2pem.cli.standing import run_of
from m2pem.journal.base import Entry, RunInfo
from m2pem.journal.codec import record_line


class Verification:
    """`difference` says where the first one is; it is empty as long as there is none."""

    def __init__(self, line: RunInfo) -> None:
        self.difference: dict[str, Any] = {}
        self._run_id = line.run
        self._loss = line.loss
        self._run = run_of(line)
        self._inputs = 0
        self._records = 0

    def agrees(self, entry: Entry) -> bool:
        """Decide the entry's input, and compare what comes of it with the entry's records."""
        step = self._run.receive(entry.input, entry.at_us)
        then = [self._line(entry.seq + n, entry.t_us, each) for n, each in enumerate(entry.records)]
        now = [self._line(step.seq + n, step.t_us, each) for n, each in enumerate(step.records)]
        if then == now:
            self._inputs += 1
            self._records += len(then)
            return True
        place = next(
            (n for n, (one, other) in enumerate(zip(then, now, strict=False)) if one != other),
            min(len(then), len(now)),
        )
        self.difference = {
            "seq": entry.seq + place,
            "input": type(entry.input).__name__,
            "journal": then[place] if place < len(then) else None,
            "decided": now[place] if place < len(now) else None,
        }
        return False

    def _line(self, seq: int, t_us: int, record: Any) -> str:
        return record_line(self._run_id, seq, t_us, record).decode()

    def as_data(self) -> dict[str, Any]:
        """For programs."""
        return {
            "run": self._run_id,
            "inputs": self._inputs,
            "records": self._records,
            "difference": self.difference or None,
            "loss": str(self._loss) if self._loss is not None else None,
        }

    def as_text(self) -> str:
        """For people."""
        same = f"{self._run_id}: {self._inputs} inputs decided again, {self._records} records"
        loss = f"\n{self._run_id}: {self._loss}" if self._loss is not None else ""
        if not self.difference:
            return f"{same}, all the same{loss}"
        return (
            f"{same} the same; then {self.difference['input']} differs at record "
            f"{self.difference['seq']}\n"
            f"  journal: {self.difference['journal'] or 'no more records'}\n"
            f"  decided: {self.difference['decided'] or 'no more records'}{loss}"
        )
