"""Faults in words, as on the command line: "1: cut link at 40 s for 600 s"."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from m2pem_plugin_mavlink.simulator.faults.faults import LOW, Action, Direction, Faults
from m2pem_plugin_mavlink.simulator.faults.link import NEVER, Rate, every, share

EXAMPLE = '"1: cut link at 40 s for 600 s"'
NUMBER = r"(\d+(?:\.\d+)?)"
SHAPE = re.compile(
    rf"(?:(?P<who>[^:\"]*):)?\s*(?P<what>.*?)(?:\s+at\s+{NUMBER}\s*s)?(?:\s+for\s+{NUMBER}\s*s)?",
    re.DOTALL,
)
WHERE = r"(?:\s+(sent|received))?"


class FaultError(ValueError):
    """It is no fault. The text says what would be right."""


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """A fault in words.

    `systems`: the vehicles (None: all); `at_s`: how long after they were armed for the first time
    (None: from the beginning); `for_s`: how long (None: for good); `mode`: the one that it needs.
    """

    text: str
    systems: tuple[int, ...] | None
    begin: Action
    end: Action | None
    at_s: float | None
    for_s: float | None
    mode: str | None = None

    def plan(self, faults: Faults) -> None:
        """Let it happen to a vehicle when its time comes.

        Raises:
            FaultError: the vehicle has no such mode.
        """
        if self.mode is not None and self.mode not in faults.modes:
            raise FaultError(
                f"fault {self.text!r}: vehicle {faults.autopilot.spec.system} has no mode "
                f"{self.mode!r}; it has: {', '.join(faults.modes)}"
            )
        if self.at_s is None:
            self._begin(faults)
        else:
            faults.after_arming(self.at_s, self._begin)

    def _begin(self, faults: Faults) -> None:
        self.begin(faults)
        if self.for_s is not None and self.end is not None:
            faults.after(self.for_s, self.end)


Made = tuple[Action, Action | None]
"""What begins a fault, and what ends it (None: nothing does)."""


def _rate(match: re.Match[str]) -> Rate:
    if match[2] is not None:
        return every(int(match[2]), int(match[2]) - 1)
    percent = float(match[1])
    if percent > 100:
        raise ValueError(f"there are no more than 100 % of the frames, so not {percent:g} %")
    return share(percent / 100)


def _link(name: str) -> Callable[[re.Match[str]], Made]:
    def made(match: re.Match[str]) -> Made:
        direction = Direction(match[3] or Direction.BOTH)
        rate = _rate(match)
        return (
            lambda faults: faults.set_link(direction, **{name: rate}),
            lambda faults: faults.set_link(direction, **{name: NEVER}),
        )

    return made


def _delay(match: re.Match[str]) -> Made:
    seconds, direction = float(match[1]), Direction(match[2] or Direction.BOTH)
    return (
        lambda faults: faults.set_link(direction, delay_s=seconds),
        lambda faults: faults.set_link(direction, delay_s=0.0),
    )


def _cut(match: re.Match[str]) -> Made:
    return Faults.cut_link, Faults.restore_link


def _battery(match: re.Match[str]) -> Made:
    left = LOW if match[1] is None else float(match[1]) / 100
    if left > 1:
        raise ValueError("a battery has at most 100 %")
    return (lambda faults: faults.set_battery(left)), None


def _refuse_arming(match: re.Match[str]) -> Made:
    refuse = Faults.refuse_arming if match[1] is None else partial(_refuse, text=match[1])
    return refuse, Faults.allow_arming


def _refuse(faults: Faults, text: str) -> None:
    faults.refuse_arming(text)


def _refuse_command(match: re.Match[str]) -> Made:
    command = int(match[1])
    return (
        lambda faults: faults.refuse_command(command),
        lambda faults: faults.allow_command(command),
    )


def _full(is_so: bool) -> Action:
    return lambda faults: setattr(faults.autopilot.injected_faults, "camera_full", is_so)


def _mode(match: re.Match[str]) -> Made:
    mode = match[1].upper()
    return (lambda faults: faults.take_over(mode)), None


HOW_OFTEN = rf"\s+(?:{NUMBER}\s*%|every\s+(\d+)){WHERE}"
ACTIONS: Mapping[str, tuple[str, Callable[[re.Match[str]], Made]]] = {
    "cut link": (r"cut link", _cut),
    "drop 5 % [sent|received], drop every 7 [sent|received]": (f"drop{HOW_OFTEN}", _link("drop")),
    "duplicate ...": (f"duplicate{HOW_OFTEN}", _link("duplicate")),
    "reorder ...": (f"reorder{HOW_OFTEN}", _link("reorder")),
    "corrupt ...": (f"corrupt{HOW_OFTEN}", _link("corrupt")),
    "delay 2 s [sent|received]": (rf"delay\s+{NUMBER}\s*s{WHERE}", _delay),
    "battery low, battery 12 %": (rf"battery\s+(?:low|{NUMBER}\s*%)", _battery),
    "lose gps": (r"lose gps", lambda _: (Faults.lose_gps, Faults.find_gps)),
    'refuse arming, refuse arming "text"': (r"refuse arming(?:\s+\"([^\"]+)\")?", _refuse_arming),
    "camera full": (r"camera full", lambda _: (_full(True), _full(False))),
    "refuse command 22": (r"refuse command\s+(\d+)", _refuse_command),
    "mode LOITER at 40 s": (r"mode\s+(\S+)", _mode),
}
"""How an action is written, its pattern, and what it does."""


def parse(text: str) -> PlannedFault:
    """Read `[VEHICLES:] ACTION [at SECONDS s] [for SECONDS s]`.

    Raises:
        FaultError: it is something else.
    """
    shape = SHAPE.fullmatch(text.strip())
    assert shape is not None, "the pattern takes anything"
    systems = _systems(text, shape["who"])
    what = shape["what"].strip()
    at_s, for_s = (None if each is None else float(each) for each in shape.groups()[2:])
    for pattern, make in ACTIONS.values():
        match = re.fullmatch(pattern, what, re.IGNORECASE)
        if match is None:
            continue
        try:
            begin, end = make(match)
        except ValueError as error:
            raise FaultError(f"fault {text!r}: {error}") from error
        if for_s is not None and end is None:
            raise FaultError(f"fault {text!r}: {what!r} has no end; leave 'for ... s' out")
        mode = match[1].upper() if make is _mode else None
        if mode is not None and at_s is None:
            raise FaultError(f"fault {text!r}: say when, such as 'mode {mode} at 40 s'")
        return PlannedFault(text, systems, begin, end, at_s, for_s, mode)
    known = "; ".join(ACTIONS)
    raise FaultError(
        f"fault {text!r}: {what!r} is no action. Actions: {known}. Then 'at 40 s' (after the first "
        f"arming; without: from the start) and 'for 600 s' (without: for good), such as {EXAMPLE}"
    )


def _systems(text: str, who: str | None) -> tuple[int, ...] | None:
    if who is None or who.strip() in ("", "all"):
        return None
    if not re.fullmatch(r"\s*\d+\s*(,\s*\d+\s*)*", who):
        raise FaultError(
            f"fault {text!r}: {who.strip()!r} are no vehicles: say their system ids, such as 1 or "
            f"1,2, or all; such as {EXAMPLE}"
        )
    return tuple(int(each) for each in who.split(","))
