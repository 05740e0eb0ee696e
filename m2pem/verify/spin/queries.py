"""Queries to Spin: one question about a model, with its options, and the answer.

A checker's exit status says nothing: its output does. A search that was cut short, at its depth,
its memory or by hand, ends with "errors: 0" as a complete one does. Every sign of that is looked
for, and output that is not understood proves nothing.
"""

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from m2pem.errors import InternalError
from m2pem.verify.search.explore import Limits, Progress, Stopped
from m2pem.verify.spin.programs import INTERRUPTED, CheckerFolder
from m2pem.verify.spin.promela import Model


class ErrorKind(StrEnum):
    """The kind of error that a checker reports."""

    ASSERTION = "assertion violated"
    CYCLE = "acceptance cycle"


class CutReason(StrEnum):
    """Why a search was cut short."""

    DEPTH = "depth"
    MEMORY = "memory"
    UNFINISHED = "unfinished"


@dataclass(frozen=True, slots=True)
class CheckerReport:
    """The output of a checker. `assertion`: the first one violated.

    `unreached`: lines of transitions that never fire; `unreached_skips`: lines that do nothing, and
    that no run reaches. Both are known of complete searches only.
    """

    states: int
    transitions: int
    errors: int
    found: ErrorKind | None
    assertion: str
    cut: CutReason | None
    unreached: frozenset[int]
    unreached_skips: frozenset[int]


NOTHING_SAID = CheckerReport(
    0, 0, 0, None, "", CutReason.UNFINISHED, unreached=frozenset(), unreached_skips=frozenset()
)

_COUNT = r"^\s*([\d.e+]+) "
_ERRORS = re.compile(r"^State-vector \d+ byte, depth reached \d+(?:, \S+)*?,? ?errors: (\d+)", re.M)
_STORED = re.compile(_COUNT + r"states, stored(?: \(([\d.e+]+) visited\))?", re.M)
_TRANSITIONS = re.compile(_COUNT + r"transitions", re.M)
_PROBLEM = re.compile(r"^pan(?:: ?\d+)?: (?:error, )?(.*)$", re.M)
_UNREACHED = re.compile(r':(\d+), state \d+, "D_STEP\d+"')
_UNREACHED_SKIP = re.compile(r':(\d+), state \d+, "\(1\)"')
_STATES = re.compile(r"States=\s*([\d.e+]+)")
_HARMLESS = ("elapsed time", "rate ", "wrote ", "resizing hashtable", "aborting", "avg transition")


def read(text: str) -> CheckerReport:
    """Parse the output of a checker.

    Raises:
        InternalError: it is not the output of a checker.
    """
    errors, stored = _ERRORS.search(text), _STORED.search(text)
    transitions = _TRANSITIONS.search(text)
    if not errors or not stored or not transitions:
        raise InternalError(f"Spin's checker did not say what it found: {text.strip()[-500:]}")
    found, assertion, cut = None, "", None
    for problem in _PROBLEM.findall(text):
        if problem.startswith("assertion violated"):
            found = found or ErrorKind.ASSERTION
            assertion = assertion or re.sub(r" \(at depth \d+\)$", "", problem[19:])
        elif problem.startswith("acceptance cycle"):
            found = found or ErrorKind.CYCLE
        elif problem.startswith(("reached -DMEMLIM", "out of memory")):
            cut = CutReason.MEMORY
        elif not problem.startswith(_HARMLESS):
            raise InternalError(f"Spin's checker reports what it was not asked: {problem}")
    if "max search depth too small" in text:
        cut = cut or CutReason.DEPTH
    elif "Search not completed" in text:
        cut = cut or CutReason.UNFINISHED
    if int(errors[1]) and found is None:
        raise InternalError(f"Spin's checker found an error that it does not name: {text[:500]}")
    return CheckerReport(
        round(float(stored[1])),
        round(float(transitions[1])),
        int(errors[1]),
        found,
        assertion,
        # A search ends at its error, and calls that not completed.
        cut if found is None or cut is not CutReason.UNFINISHED else None,
        frozenset(int(line) for line in _UNREACHED.findall(text)),
        frozenset(int(line) for line in _UNREACHED_SKIP.findall(text)),
    )


def states_so_far(text: str) -> int:
    """Return the number of states that a running checker has reported."""
    output = _STATES.findall(text)
    return round(float(output[-1])) if output else 0


class Storage(StrEnum):
    """How Spin stores visited states."""

    EXACT = "exact"
    COLLAPSE = "collapse"
    """Compressed: less memory for large states, but slower."""
    BITSTATE = "bitstate"
    """A few bits per state in a table of fixed size: finds violations, but proves nothing."""


_DEFINES = {
    Storage.EXACT: (),
    Storage.COLLAPSE: ("-DCOLLAPSE",),
    Storage.BITSTATE: ("-DBITSTATE",),
}
_HASH_BITS = 18
"""A table of 2 MB, which grows when it is full; Spin's own default takes 128 MB at once."""
_BITSTATE_BITS = 30
"""Of 128 MB; that table cannot grow."""
FIRST_DEPTH = 100_000
MOST_DEPTH = 20_000_000
"""Steps of the deepest path: of the first search, and of the last after deeper and deeper ones."""
_LEAST_VECTOR_BYTES = 1024
_CUTS = {
    CutReason.DEPTH: Stopped.DEPTH,
    CutReason.MEMORY: Stopped.MEMORY,
    CutReason.UNFINISHED: Stopped.TIME,
}
_ENDINGS = {
    INTERRUPTED: Stopped.INTERRUPTED,
    "states": Stopped.STATES,
    "time": Stopped.TIME,
}


@dataclass(frozen=True, slots=True)
class QueryResult:
    """Spin's answer to one query. `stopped`: why it did not see all, if it found nothing."""

    report: CheckerReport
    stopped: Stopped | None


@dataclass(slots=True)
class SpinQueries:
    """Queries to Spin, within limits for all of them together. `began` is in monotonic seconds."""

    shop: CheckerFolder
    limits: Limits
    storage: Storage
    began: float
    progress: Callable[[Progress], None] | None = None

    def query(
        self,
        model: Model,
        *,
        shortest: bool = False,
        cycles: bool = False,
        errors: int = 1,
        seconds: float | None = None,
    ) -> QueryResult:
        """Search a model. `shortest`: nearest first; `cycles`: look for acceptance cycles as well.

        `errors`: how many are looked for. `seconds`: a limit for this query.
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
        depth = FIRST_DEPTH
        while True:
            arguments = [f"-w{bits}", f"-m{depth}", f"-c{errors}"]
            arguments += ["-a"] if cycles else []
            arguments += ["-e"] if errors != 1 else []
            output = self.shop.search(defines, arguments, self._watch(seconds))
            unfinished = output.ended and not output.text  # before it said anything
            report = NOTHING_SAID if unfinished else read(output.text)
            too_deep = report.found is None and report.cut is CutReason.DEPTH and not output.ended
            if too_deep and depth < MOST_DEPTH:
                depth *= 10
                continue
            return QueryResult(report, self._stopped(report, output.ended, shortest=shortest))

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
        """Seconds since the first query."""
        return time.monotonic() - self.began

    def _stopped(self, report: CheckerReport, ended: str, *, shortest: bool) -> Stopped | None:
        if report.found is not None:
            return None
        if ended:
            return _ENDINGS[ended]
        if report.cut is not None:
            return _CUTS[report.cut]
        if self.storage is Storage.BITSTATE and not shortest:
            return Stopped.BITSTATE
        return None
