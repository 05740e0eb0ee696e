"""Results: a verdict for each property, how each violation comes about, and what verdicts are read
from.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import islice

from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import NOTHING, Assumptions
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Action, Approximation, Exactness, Flag, PetriNet, Role
from m2pem.verify.search.explore import Exploration


class Verdict(StrEnum):
    """An incomplete search that has seen no violation has proved nothing; a violation that the
    engine was not seen to do may be a false alarm."""

    HOLDS = "holds"
    VIOLATED = "violated"
    MAY_BE_VIOLATED = "may be violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Violation:
    """One way in which a property is violated.

    `elements`: where it shows (ids), those that are stuck or have a second token first. `run`: the
    transitions that lead there, by number in the net that was searched; `cycle`: those that then go
    on for ever.
    """

    message: str
    elements: tuple[str, ...] = ()
    run: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()
    doubt: str = ""
    """Why it may be a false alarm; "": it is certain."""


@dataclass(frozen=True, slots=True)
class Result:
    """The verdict on one property, or on one requirement of the mission's author (`required`).

    `property`: its name, or the requirement's id. `text`: what it says. `warning`: a violation of
    it is a warning, unless strict. `author`: the author's own description of the requirement.
    """

    property: str
    text: str
    verdict: Verdict
    violations: tuple[Violation, ...] = ()
    warning: bool = False
    covered: str = ""
    """Undecided: what was searched, or why there is no answer. May be violated: why that is not
    certain. Holds: in what sense, if there is more to say.
    """
    required: bool = False
    author: str = ""
    assumed: Assumptions = NOTHING
    """What the verdict assumes."""
    without: "Result | None" = None
    """The answer to the same where nothing is assumed."""
    would_hold_if: Assumptions = NOTHING
    """Violated, where nothing is assumed: it holds under this assumption."""
    would_hold_if_fair: bool = False
    """The same, of a requirement about all runs: it holds of fair runs, if that is assumed, too."""
    net: PetriNet | None = None
    """The net whose transitions the runs number; None: as `Report.transitions_of` says."""


MOST_VIOLATIONS = 10
"""Most violations of one property: the shortest runs to each place where it shows."""

Confirm = Callable[[PetriNet, Sequence[int]], str]
"""Where the engine does not follow a run of a net; "": it does."""


def bounded(found: Exploration) -> tuple[Approximation, ...]:
    """Return the approximations of a net that made a difference in a search, or may have made it.

    If any of them is a bound, what no run of the net does may happen all the same.
    """
    net = found.net
    lost = [net.places[place] for place in found.lost]
    reached = {each.name for each in lost}
    for place in lost:
        reached |= {part.partition("#")[0] for part in net.scopes[place.scope].path}
    for number in found.fired:
        for step in net.transitions[number].steps:
            if step.action is Action.NOT_FOLLOWED:
                reached.add(step.element)
    return tuple(each for each in net.approximations if not each.bound or each.bound in reached)


def _loses(encoding: Encoding, run: Sequence[int]) -> bool:
    """Whether tokens that are counted have no room in a run, but for its last transition."""
    state, places = encoding.initial, encoding.net.places
    for number in run[:-1]:
        state, full = encoding.fire(number, state)
        if full and any(places[p].several or not places[p].once for p in encoding.places_in(full)):
            return True
    return False


BEYOND = "what happens beyond a bound of the search is not known"
UNEXPLAINED = (
    "the search takes the steps of one moment in any order; if their order does not explain that, "
    "the search is at fault: please report it"
)
"""The reason for doubts where the net is exact."""


def judged(
    violations: Iterable[Violation],
    encoding: Encoding,
    confirm: Confirm | None,
    *,
    explained: bool,
    begins: bool = False,
) -> tuple[Violation, ...]:
    """Return violations, the certain ones first, each with its doubt. `encoding`: with which they
    were found; `explained`: something explains false alarms. `begins`: a violation without a run is
    one of the state in which the mission begins."""
    known = []
    for each in islice(violations, MOST_VIOLATIONS):
        doubt, run = each.doubt, (*each.run, *each.cycle)
        if not doubt and confirm is not None and (run or begins):
            doubt = BEYOND if _loses(encoding, run) else ""
            if not doubt and (where := confirm(encoding.net, run)):
                why = "" if explained else f"; {UNEXPLAINED}"
                doubt = f"the engine does not follow its run: {where}{why}"
        known.append(replace(each, doubt=doubt))
    return tuple(sorted(known, key=lambda each: bool(each.doubt)))


@dataclass(slots=True)
class SearchedMission:
    """A mission, its net and its exploration.

    `watched`: the exploration of the net that also notes which vehicles were interrupted;
    `resources`: the vehicle of each such place.
    """

    mission: Mission
    net: PetriNet
    found: Exploration
    watched: Exploration | None = None
    resources: dict[int, str] = field(default_factory=dict)
    confirm: Confirm | None = None
    """None: no run is executed."""

    @property
    def is_bounded(self) -> bool:
        """Whether something may happen in the mission that no run of the net does."""
        bounds = bounded(self.found)
        return bool(self.found.lost) or any(each.exactness is Exactness.BOUNDED for each in bounds)

    def label(self, element: str) -> str:
        """The name of an element for people."""
        known = self.mission.elements.get(element)
        if known is None or not known.name:
            return element
        return f"{element} ({known.name})"

    def labels(self, elements: tuple[str, ...]) -> str:
        """The names of several elements."""
        return ", ".join(self.label(each) for each in elements)

    def where(self, state: int) -> tuple[str, ...]:
        """Elements with a token in a state, without those around other such elements."""
        net = self.net
        places = [
            net.places[p]
            for p in self.found.marking(state).tokens
            if net.places[p].role not in (Role.CONTROL, Role.END)
        ]
        around: set[tuple[str, ...]] = set()
        for place in places:
            path = net.scopes[place.scope].path
            around |= {path[:n] for n in range(1, len(path) + 1)}
        inner = [
            place
            for place in places
            if (*net.scopes[place.scope].path, place.element) not in around
        ]
        return tuple(dict.fromkeys(self.node_of(place.element) for place in inner))

    def node_of(self, element: str) -> str:
        """The join at which a token of a flow waits; for other elements, the element itself."""
        known = self.mission.elements.get(element)
        target = getattr(known, "target", None)
        return target.id if target is not None else element

    def ended(self, state: int) -> bool:
        return bool(self.found.states[state] & self.found.encoding.places_mask(self.net.ends))

    def never(self, flag: Flag) -> bool:
        """Whether the net proves, without a search, that nothing of this flag fires."""
        transitions = self.net.transitions
        return bool(transitions) and all(each.flag is not flag for each in transitions)

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
        begins: bool = False,
    ) -> Result:
        """Violated if there are violations; else it holds, if all was seen.

        `static`: no search was needed. `note`: in what sense it holds. `begins`: see `judged`.
        """
        found = found or self.found
        if violations:
            explained = bool(bounded(self.found) or self.found.overflows)
            known = judged(
                violations, found.encoding, self.confirm, explained=explained, begins=begins
            )
            doubt = known[0].doubt
            verdict = Verdict.MAY_BE_VIOLATED if doubt else Verdict.VIOLATED
            return Result(name, text, verdict, known, warning, doubt)
        if static or found.complete:
            return Result(name, text, Verdict.HOLDS, (), warning, note)
        covered = f"{len(found.states):,} states, stopped by {found.stopped}"
        return Result(name, text, Verdict.UNDECIDED, (), warning, covered)
