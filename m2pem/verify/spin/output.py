"""Reading what a checker of Spin prints. Its exit status means nothing: the text does.

A search that was cut short, at its depth, its memory or by hand, ends with "errors: 0" as a whole
one does; every sign of that is looked for, and a text that is not understood is no proof.
"""

import re
from dataclasses import dataclass
from enum import StrEnum

from m2pem.errors import InternalError


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
