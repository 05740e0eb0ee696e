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
from m2pem.verify.spin.programs import INTERRUPTED, Workshop
from m2pem.verify.spin.promela import Model


class Found(StrEnum):
    """What a checker reports as an error."""

    ASSERTION = "assertion violated"
    CYCLE = "acceptance cycle"


class Cut(StrEnum):
    """Why a search was cut short."""

    DEPTH = "depth"
    MEMORY = "memory"
    UNFINISHED = "unfinished"


@dataclass(frozen=True, slots=True)
class Report:
    """What was printed. `assertion`: the first one violated.

    `unreached`: lines of rules that never fire; `unreached_skips`: lines that do nothing, and that
    no run comes to. Both are told of whole searches only.
    """

    states: int
    transitions: int
    errors: int
    found: Found | None
    assertion: str
    cut: Cut | None
    unreached: frozenset[int]
    unreached_skips: frozenset[int]


_COUNT = r"^\s*([\d.e+]+) "
_ERRORS = re.compile(r"^State-vector \d+ byte, depth reached \d+(?:, \S+)*?,? ?errors: (\d+)", re.M)
_STORED = re.compile(_COUNT + r"states, stored(?: \(([\d.e+]+) visited\))?", re.M)
_NOMINAL = re.compile(_COUNT + r"nominal states", re.M)
_TRANSITIONS = re.compile(_COUNT + r"transitions", re.M)
_PROBLEM = re.compile(r"^pan(?:: ?\d+)?: (?:error, )?(.*)$", re.M)
_UNREACHED = re.compile(r':(\d+), state \d+, "D_STEP\d+"')
_UNREACHED_SKIP = re.compile(r':(\d+), state \d+, "\(1\)"')
_STATES = re.compile(r"States=\s*([\d.e+]+)")
_HARMLESS = ("elapsed time", "rate ", "wrote ", "resizing hashtable", "aborting", "avg transition")


def read(text: str) -> Report:
    """What a checker printed.

    Raises:
        InternalError: it is not what a checker prints.
    """
    errors, stored = _ERRORS.search(text), _STORED.search(text)
    transitions = _TRANSITIONS.search(text)
    if not errors or not stored or not transitions:
        raise InternalError(f"Spin's checker did not say what it found: {text.strip()[-500:]}")
    found, assertion, cut = None, "", None
    for problem in _PROBLEM.findall(text):
        if problem.startswith("assertion violated"):
            found = found or Found.ASSERTION
            assertion = assertion or re.sub(r" \(at depth \d+\)$", "", problem[19:])
        elif problem.startswith("acceptance cycle"):
            found = found or Found.CYCLE
        elif problem.startswith(("reached -DMEMLIM", "out of memory")):
            cut = Cut.MEMORY
        elif not problem.startswith(_HARMLESS):
            raise InternalError(f"Spin's checker reports what nobody asked: {problem}")
    if "max search depth too small" in text:
        cut = cut or Cut.DEPTH
    elif "Search not completed" in text:
        cut = cut or Cut.UNFINISHED
    if int(errors[1]) and found is None:
        raise InternalError(f"Spin's checker found an error that it does not name: {text[:500]}")
    return Report(
        round(float(stored[1])),
        round(float(transitions[1])),
        int(errors[1]),
        found,
        assertion,
        # A search ends at its error, and calls that not completed.
        cut if found is None or cut is not Cut.UNFINISHED else None,
        frozenset(int(line) for line in _UNREACHED.findall(text)),
        frozenset(int(line) for line in _UNREACHED_SKIP.findall(text)),
    )


def states_so_far(text: str) -> int:
    """How many states a checker that still runs has told of."""
    told = _STATES.findall(text)
    return round(float(told[-1])) if told else 0


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
