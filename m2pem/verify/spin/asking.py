"""Asking Spin one thing of a model: with what options, and what came of it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from m2pem.verify.explore import Limits, Progress, Stopped
from m2pem.verify.spin.output import Cut, Report, read, states_so_far
from m2pem.verify.spin.programs import INTERRUPTED, Workshop
from m2pem.verify.spin.promela import Model


class Storage(StrEnum):
    """How Spin remembers the states that it has seen."""

    EXACT = "exact"
    COLLAPSE = "collapse"
    """Compressed: less memory for large states, and slower."""
    BITSTATE = "bitstate"
    """As a few bits in a table of fixed size: finds violations, but proves nothing."""


_DEFINES = {
    Storage.EXACT: (),
    Storage.COLLAPSE: ("-DCOLLAPSE",),
    Storage.BITSTATE: ("-DBITSTATE",),
}
_HASH_BITS = 18
"""A table of 2 MB, which grows when it is full; Spin's own default takes 128 MB at once."""
_BITSTATE_BITS = 30
"""Of 128 MB; that table cannot grow."""
_FIRST_DEPTH = 100_000
_MOST_DEPTH = 20_000_000
_LEAST_VECTOR_BYTES = 1024
_CUTS = {Cut.DEPTH: Stopped.DEPTH, Cut.MEMORY: Stopped.MEMORY, Cut.UNFINISHED: Stopped.TIME}
_ENDINGS = {
    INTERRUPTED: Stopped.INTERRUPTED,
    "states": Stopped.STATES,
    "time": Stopped.TIME,
}


@dataclass(frozen=True, slots=True)
class Told:
    """What Spin said to one question. `stopped`: why it did not see all, if it found nothing."""

    report: Report
    stopped: Stopped | None


@dataclass(slots=True)
class Asking:
    """Asks, within limits that hold for all questions together. `began` is monotonic seconds."""

    shop: Workshop
    limits: Limits
    storage: Storage
    began: float
    progress: Callable[[Progress], None] | None = None

    def ask(
        self,
        model: Model,
        *,
        shortest: bool = False,
        cycles: bool = False,
        errors: int = 1,
        seconds: float | None = None,
    ) -> Told:
        """Have a model searched. `shortest`: nearest first; `cycles`: for rounds as well.

        `errors`: how many are looked for. `seconds`: a limit for this question.
        """
        self.shop.generate(model.text)
        defines = ["-DNOREDUCE", f"-DMEMLIM={max(round(self.limits.memory_mb), 1)}"]
        if not cycles:
            defines.append("-DSAFETY")
        if shortest:
            defines.append("-DBFS")
        else:
            defines += _DEFINES[self.storage]
        vector = model.size_bytes
        if vector > _LEAST_VECTOR_BYTES:
            defines.append(f"-DVECTORSZ={vector}")
        bits = _BITSTATE_BITS if self.storage is Storage.BITSTATE and not shortest else _HASH_BITS
        depth = _FIRST_DEPTH
        while True:
            arguments = [f"-w{bits}", f"-m{depth}", f"-c{errors}"]
            arguments += ["-a"] if cycles else []
            arguments += ["-e"] if errors != 1 else []
            told = self.shop.search(defines, arguments, self._watch(seconds))
            report = read(told.text)
            too_deep = report.found is None and report.cut is Cut.DEPTH and not told.ended
            if too_deep and depth < _MOST_DEPTH:
                depth *= 10
                continue
            return Told(report, self._stopped(report, told.ended, shortest=shortest))

    def _watch(self, seconds: float | None) -> Callable[[str, float], str]:
        def watch(printed: str, taken: float) -> str:
            states = states_so_far(printed)
            if self.progress is not None:
                self.progress(Progress(states, 0, self.began_ago()))
            if states > self.limits.states:
                return "states"
            late = seconds is not None and taken > seconds
            return "time" if late or self.began_ago() > self.limits.seconds else ""

        return watch

    def began_ago(self) -> float:
        """Seconds since the first question."""
        return time.monotonic() - self.began

    def _stopped(self, report: Report, ended: str, *, shortest: bool) -> Stopped | None:
        if report.found is not None:
            return None
        if ended:
            return _ENDINGS[ended]
        if report.cut is not None:
            return _CUTS[report.cut]
        if self.storage is Storage.BITSTATE and not shortest:
            return Stopped.BITSTATE
        return None
