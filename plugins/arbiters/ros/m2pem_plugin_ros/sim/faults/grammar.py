"""Faults in words, as on the command line: "evsg1: silent at 20 s for 5 s"."""

import re
from dataclasses import dataclass

from m2pem_plugin_ros.settings import DriverName
from m2pem_plugin_ros.sim.faults.actions import KINDS, NUMBER, Action, Kind
from m2pem_plugin_ros.sim.specification import VehicleSpec

EXAMPLE = '"evsg1: silent at 20 s for 5 s"'
SHAPE = re.compile(
    rf"(?:(?P<who>[^:\"]*):)?\s*(?P<what>.*?)"
    rf"(?:\s+at\s+(?P<at>{NUMBER})\s*s)?(?:\s+for\s+(?P<for>{NUMBER})\s*s)?",
    re.DOTALL,
)
NAME = re.compile(r"[A-Za-z_][\w-]*")


class FaultError(ValueError):
    """It is no fault, or cannot happen there. The text says what would be right."""


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """A fault in words.

    `vehicles`: their names (None: all); `at_s`: how long after it was planned; `for_s`: how long it
    lasts (None: for good). Both are simulated time.
    """

    text: str
    vehicles: tuple[str, ...] | None
    kind: Kind
    begin: Action
    end: Action | None
    at_s: float = 0.0
    for_s: float | None = None

    def check(self, spec: VehicleSpec) -> None:
        """See that it can happen to a vehicle.

        Raises:
            FaultError: it cannot, and why.
        """
        if spec.settings.driver not in self.kind.drivers:
            needs = " or ".join(WORDS[each] for each in self.kind.drivers)
            raise FaultError(
                f"fault {self.text!r}: {spec.name} is {WORDS[spec.settings.driver]}; that happens "
                f"to {needs} alone"
            )
        if self.kind.detector and not spec.detectors:
            raise FaultError(f"fault {self.text!r}: {spec.name} carries no detector")


WORDS = {
    DriverName.NODE: "an m2pem node",
    DriverName.NAV2: "Nav2",
    DriverName.BASE: "a plain base",
}


def parse(text: str) -> PlannedFault:
    """Read `[VEHICLES:] ACTION [at SECONDS s] [for SECONDS s]`.

    Raises:
        FaultError: it is something else.
    """
    shape = SHAPE.fullmatch(text.strip())
    assert shape is not None, "the pattern takes anything"
    vehicles = _vehicles(text, shape["who"])
    what = " ".join(shape["what"].split())
    at_s = float(shape["at"] or 0.0)
    for_s = None if shape["for"] is None else float(shape["for"])
    for kind in KINDS.values():
        match = re.fullmatch(kind.pattern, what, re.IGNORECASE)
        if match is None:
            continue
        try:
            begin, end = kind.make(match)
        except ValueError as error:
            raise FaultError(f"fault {text!r}: {error}") from error
        if for_s is not None and end is None:
            raise FaultError(f"fault {text!r}: {what!r} has no end; leave 'for ... s' out")
        return PlannedFault(text, vehicles, kind, begin, end, at_s, for_s)
    known = "; ".join(KINDS)
    raise FaultError(
        f"fault {text!r}: {what!r} is no action. Actions: {known}. Then 'at 20 s' (without: at "
        f"once) and 'for 5 s' (without: for good), such as {EXAMPLE}"
    )


def _vehicles(text: str, who: str | None) -> tuple[str, ...] | None:
    if who is None or who.strip() in ("", "all"):
        return None
    names = tuple(each.strip() for each in who.split(","))
    if not all(NAME.fullmatch(each) for each in names):
        raise FaultError(
            f"fault {text!r}: {who.strip()!r} are no vehicles: say their names, such as evsg1 or "
            f"evsg1,evsg2, or all; such as {EXAMPLE}"
        )
    return names
