"""The notation of what happens from outside: `answer u yes`, `message M`, `advance 5 s`."""

import re
from dataclasses import dataclass, field
from typing import Literal, get_args

from m2pem.mission.values import Value

Verb = Literal[
    "start", "answer", "complete", "fail", "cancelled", "signal", "message", "advance",
    "pause", "resume", "stop",
]  # fmt: skip
VERBS: tuple[str, ...] = get_args(Verb)

_UNITS_S = {"ms": 0.001, "s": 1, "min": 60, "h": 3600, "d": 86400}
_WORDS = {
    "start": (0, 0),
    "answer": (1, 2),
    "complete": (1, 1),
    "fail": (1, 2),
    "cancelled": (1, 1),
    "signal": (1, 1),
    "message": (1, 1),
    "advance": (1, 2),
    "pause": (0, 0),
    "resume": (0, 0),
    "stop": (0, 0),
}


@dataclass(frozen=True, slots=True)
class When:
    """One input. `name`: of the element, signal or message; `word`: the decision or error code;
    `number`: which of several that wait at the element, from 1, in the order of their arrival."""

    text: str
    verb: str
    name: str = ""
    word: str = ""
    number: int = 1
    seconds: float = 0
    data: dict[str, Value] = field(default_factory=dict)


def read_when(text: str, data: dict[str, Value]) -> When:
    """The input that `text` says, with its data.

    Raises:
        ValueError: it says none; the message tells why.
    """
    verb, *words = text.split() or [""]
    if verb not in VERBS:
        raise ValueError(f"{text!r} begins with none of {', '.join(VERBS)}")
    least, most = _WORDS[verb]
    if not least <= len(words) <= most:
        raise ValueError(f"{text!r}: {verb} takes {least} to {most} words")
    if data and verb not in ("complete", "signal", "message"):
        raise ValueError(f"{text!r}: {verb} takes no data")
    if verb == "advance":
        return When(text, verb, seconds=_seconds("".join(words), text))
    words += ["", ""]
    name, _, number = words[0].partition("#")
    return When(text, verb, name, words[1], int(number or 1), data=data)


def _seconds(amount: str, text: str) -> float:
    match = re.fullmatch(r"([\d.]+)([a-z]+)", amount)
    if match is None or match[2] not in _UNITS_S:
        raise ValueError(f"{text!r}: say how long as in `advance 5 s` ({', '.join(_UNITS_S)})")
    return float(match[1]) * _UNITS_S[match[2]]
