"""Results: a verdict for each property, how each violation comes about, and what verdicts are read
from.
"""

from dataclasses import dataclass, field
from enum import StrEnum

from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import Role, System
from m2pem.verify.search.explore import Exploration


class Verdict(StrEnum):
    """Three-valued: a search that was cut short has seen no violation, and proved nothing."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Violation:
    """One way in which a property does not hold.

    `elements`: where it shows (ids), the stuck or doubled ones first. `run`: the rules that lead
    there, by number in the system that was searched; `cycle`: those that then go on for ever.
    """

    message: str
    elements: tuple[str, ...] = ()
    run: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Result:
    """The verdict on one property, or on one requirement of the mission's author (`required`).

    `property`: its name, or the requirement's id. `text`: what it says. `warning`: a violation of
    it is a warning, unless strict. `author`: what the author says that a requirement is for.
    """

    property: str
    text: str
    verdict: Verdict
    violations: tuple[Violation, ...] = ()
    warning: bool = False
    covered: str = ""
    """Of an undecided one: what was looked at, or what stands in the way. Of one that holds: in
    what sense, if there is more to say."""
    required: bool = False
    author: str = ""


MOST_VIOLATIONS = 10
"""Of one property: the shortest ways to each place where it shows."""


@dataclass(slots=True)
class Searched:
    """`watched`: the same, of the rules that also note which resources were interrupted, by place
    the resource."""

    mission: Mission
    system: System
    found: Exploration
    watched: Exploration | None = None
    resources: dict[int, str] = field(default_factory=dict)

    def label(self, element: str) -> str:
        """What to call an element in front of a person."""
        known = self.mission.elements.get(element)
        if known is None or not known.name:
            return element
        return f"{element} ({known.name})"

    def labels(self, elements: tuple[str, ...]) -> str:
        """The same, of several."""
        return ", ".join(self.label(each) for each in elements)

    def where(self, state: int) -> tuple[str, ...]:
        """Elements with a token in a state, the innermost of those around each other only."""
        system = self.system
        places = [
            system.places[p]
            for p in self.found.marking(state).tokens
            if system.places[p].role not in (Role.CONTROL, Role.END)
        ]
        around: set[tuple[str, ...]] = set()
        for place in places:
            path = system.scopes[place.scope].path
            around |= {path[:n] for n in range(1, len(path) + 1)}
        inner = [
            place
            for place in places
            if (*system.scopes[place.scope].path, place.element) not in around
        ]
        return tuple(dict.fromkeys(self.node_of(place.element) for place in inner))

    def node_of(self, element: str) -> str:
        """A token that waits at a join by a flow is at the join."""
        known = self.mission.elements.get(element)
        target = getattr(known, "target", None)
        return target.id if target is not None else element

    def ended(self, state: int) -> bool:
        """Whether the run is over in a state."""
        return bool(self.found.marking(state).tokens.keys() & self.system.ends)

    def result(
        self,
        name: str,
        text: str,
        violations: list[Violation],
        *,
        warning: bool = False,
        static: bool = False,
        found: Exploration | None = None,
        note: str = "",
    ) -> Result:
        """Violated if there are violations; else it holds, if all was seen. `static`: no search
        was needed. `note`: in what sense it holds."""
        if violations:
            return Result(
                name, text, Verdict.VIOLATED, tuple(violations[:MOST_VIOLATIONS]), warning
            )
        found = found or self.found
        if static or found.complete:
            return Result(name, text, Verdict.HOLDS, (), warning, note)
        covered = f"{len(found.states):,} states, stopped by {found.stopped}"
        return Result(name, text, Verdict.UNDECIDED, (), warning, covered)
