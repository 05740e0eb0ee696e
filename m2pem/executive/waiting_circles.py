"""Circles of tasks that wait for each other: found when they close, said to operators.

A task waits for a vehicle or payload that a run has or keeps, or that is kept for another task; or
for space where a vehicle is.
"""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from m2pem.allocation.circles import Until, Waiting, circles
from m2pem.allocation.needs import ConsideredRole
from m2pem.api.runs import Alert, RunId
from m2pem.engine.records import Trigger
from m2pem.engine.state import AllocationRequest, Behavior, BehaviorPhase, Token
from m2pem.executive.allocation_requests import ConsideredRequest
from m2pem.executive.runner import Runner
from m2pem.executive.waiting_tasks import holder_label
from m2pem.fleet.behaviors import ENDING_PARAMETERS
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.elements import BoundaryEvent, StartEvent

if TYPE_CHECKING:
    from m2pem.deconfliction.conflicts import Refusal

BY_ITSELF = Until()


@dataclass(eq=False)
class WaitingCircles:
    """Warns operators of each circle once. `runners`: the runs that are driven here."""

    _runners: Mapping[RunId, Runner]
    _graph: ResourceGraph
    _publish: Callable[[Alert], None]
    _known: set[frozenset[str]] = field(default_factory=set)

    def look(
        self,
        left: Sequence[ConsideredRequest],
        refusals: "Mapping[str, Sequence[Refusal]]",
        kept: Mapping[ResourceId, str],
    ) -> None:
        """Warn operators of tasks that wait for each other, once for each circle.

        `left`: all that waits, in its order. `refusals`: of what waits for space, why its vehicles
        have none, the one that it would go with first; the rest waits for resources. `kept`: what
        is free and kept from later tasks, and for which request.
        """
        waiting = {
            each.request.id: each
            for each in left
            if not each.asked.chosen  # else vehicles are taken from other runs for it
            and (each.request.id in refusals or (each.waits and not each.request.deadline))
            and not _is_ended_by_timer(each.request)
        }
        runners = {each.asked.runner.id: each.asked.runner for each in waiting.values()}
        idle = [each for each in runners.values() if self._is_idle(each, refusals)]
        needs = _Needs(waiting, idle, refusals, kept)
        found = circles([Waiting(number, needs.of(each)) for number, each in waiting.items()])
        for circle in found:
            if circle not in self._known:
                asking = [each for number, each in waiting.items() if number in circle]
                lacks = "; ".join(self._lacks(each, needs) for each in asking)
                text = f"{lacks}: {_advice(asking, needs)}"
                for run in sorted({each.asked.runner.id for each in asking}):
                    self._publish(Alert(run, "WAITING_CIRCLE", text))
        self._known = set(found)

    def _goes_on(self, known: Behavior) -> bool:
        """Whether a behavior ends only when its run ends it."""
        if known.phase is not BehaviorPhase.ACTIVE:
            return False
        if not ENDING_PARAMETERS.isdisjoint(known.parameters):
            return False
        kind = BehaviorType(known.type)
        spec = self._graph.spec(known.resources[0], known.name, kind)
        return spec is not None and not spec.ends

    def _is_idle(self, runner: Runner, in_space: Collection[str]) -> bool:
        """Whether a run can go on only by getting what it asked for. `in_space`: the requests that
        wait for space, which they do for a while."""
        state = runner.run.state
        limits = {e.deadline for number, e in state.allocations.items() if number in in_space}
        others = [e.deadline for number, e in state.allocations.items() if number not in in_space]
        if any(others) or state.prompts or state.services or state.incidents:
            return False
        return state.waits.keys() <= limits and all(map(self._goes_on, state.behaviors.values()))

    def _who(self, holder: str) -> str:
        """Return what holds something in words: its task, run and mission."""
        return holder_label(self._runners, holder, mission=True) or holder

    def _lacks(self, each: ConsideredRequest, needs: "_Needs") -> str:
        """Say which task waits for what, and who has it."""
        who = self._who(each.request.id)
        if refusal := needs.refusal(each):
            ids = {blocker.behavior for blocker in refusal.blockers if blocker.behavior}
            words = re.compile(rf"\b({'|'.join(map(re.escape, sorted(ids)))})\b")
            said = words.sub(lambda found: self._who(found[0]), refusal.reason)
            return f"{who}: {said if ids else refusal.reason}"
        has = [
            f"{resource} ({how} {self._who(by)})"
            for role in each.roles
            for how, found in (
                ("held by", {e: role.occupied[e].holder for e in role.options.busy}),
                ("kept for", needs.kept_from(each, role)),
            )
            for resource, by in found.items()
        ]
        return f"{who} waits for {', '.join(dict.fromkeys(has))}"


def _is_ended_by_timer(request: AllocationRequest) -> bool:
    """Whether an interrupting timer runs on a task that asks, or on a scope around it."""
    token: Token | None = request.token
    while token is not None:
        around = [*(token.waits or {}).values(), *(token.scope.waits or {}).values()]
        for wait in around:
            if (
                wait.trigger is Trigger.TIMER
                and isinstance(wait.node, BoundaryEvent | StartEvent)
                and wait.node.interrupting
            ):
                return True
        token = token.scope.owner
    return False


class _Needs:
    """What requests lack, and who has it. `waiting`: by their ids. `idle`: the runs that can go on
    only by getting what they asked for; what others have becomes free by itself."""

    def __init__(
        self,
        waiting: Mapping[str, ConsideredRequest],
        idle: Sequence[Runner],
        refusals: "Mapping[str, Sequence[Refusal]]",
        kept: Mapping[ResourceId, str],
    ) -> None:
        self._refusals = refusals
        self._kept = kept
        self._order = {number: place for place, number in enumerate(waiting)}
        self._holders: dict[str, Until] = {}
        self._at_rest: dict[str, Until] = {}
        for runner in idle:
            state = runner.run.state
            until = Until(state.allocations)
            self._holders |= dict.fromkeys(state.behaviors, until)
            self._holders |= {each.id: until for each in state.kept.values()}
            self._at_rest |= dict.fromkeys(state.kept, until)
        self._movers: dict[str, list[str]] = {}
        if refusals:  # a vehicle at rest is moved by the task that waits for it
            for number, each in waiting.items():
                for vehicle in each.named_vehicles:
                    self._movers.setdefault(vehicle, []).append(number)
        self._known: dict[int, Counter[Until]] = {}
        self._together: dict[tuple[int, ...], tuple[int, Counter[Until]]] = {}

    def refusal(self, each: ConsideredRequest) -> "Refusal | None":
        """Return why a request has no space; None: it waits for resources."""
        found = self._refusals.get(each.request.id)
        return found[0] if found else None

    def in_way(self, each: ConsideredRequest) -> list[ResourceId]:
        """Return the vehicles that a request waits for to leave."""
        refusal = self.refusal(each)
        blockers = refusal.blockers if refusal else ()
        return [blocker.vehicle for blocker in blockers if blocker.behavior not in self._refusals]

    def kept_from(self, each: ConsideredRequest, role: ConsideredRole) -> dict[ResourceId, str]:
        """Return what is free for a role, but kept for requests that come first."""
        if not each.in_turn:
            return {}
        number, last = each.request.id, len(self._order)
        place = self._order[number]
        return {
            resource: by
            for resource, by in self._kept.items()
            if self._order.get(by, last) < place and resource in role.options.costs_s
        }

    def of(self, each: ConsideredRequest) -> tuple[tuple[int, Mapping[Until, int]], ...]:
        """Return what a request lacks, as `Waiting` has it."""
        kept = [self.kept_from(each, role) for role in each.roles]
        lacks = [self._lacks(each, role, by) for role, by in zip(each.roles, kept, strict=True)]
        number, refusal = each.request.id, self.refusal(each)
        if refusal is None:
            if len(lacks) > 1:
                lacks.append(self._lacks_together(each, kept))
            return tuple((count, held) for count, held in lacks if count > 0)
        if refusal.wait_s is None:
            return ()  # it is refused
        if all(role.named for role in each.roles):
            return ((refusal.lacking, Counter(self._leave(number, refusal))),)
        # It may also go with others: it is taken to need one of all that is in their way.
        held = sum((more for _, more in lacks), Counter[Until]())
        for other in self._refusals[number]:
            held.update(self._leave(number, other))
        return ((min(1, refusal.lacking), held),)

    def _lacks(
        self, each: ConsideredRequest, role: ConsideredRole, kept: Mapping[ResourceId, str]
    ) -> tuple[int, Counter[Until]]:
        """Return how many more a role needs than are free, and who has how many. What its task has
        lost may return by itself; it shares its candidates with no other task. `kept`: what is
        free for it, but kept for requests that come first."""
        found, options = role.candidacy, role.options
        if id(found) not in self._known:
            self._known[id(found)] = Counter(self._held(each, role).values())
        count = options.least - len(options.costs_s) + len(kept)
        return count, _with_kept(self._known[id(found)], kept)

    def _lacks_together(
        self, each: ConsideredRequest, kept: Sequence[Mapping[ResourceId, str]]
    ) -> tuple[int, Counter[Until]]:
        """Return the same for all roles of a task, which may share candidates."""
        key = tuple(id(role.candidacy) for role in each.roles)
        if key not in self._together:
            free: set[ResourceId] = set()
            until: dict[ResourceId, Until] = {}
            for role in each.roles:
                free |= role.options.costs_s.keys()
                until |= self._held(each, role)
            self._together[key] = len(free), Counter(until.values())
        free_count, held = self._together[key]
        from_all = {one: by for of_role in kept for one, by in of_role.items()}
        least = sum(role.options.least for role in each.roles)
        return least - free_count + len(from_all), _with_kept(held, from_all)

    def _held(self, each: ConsideredRequest, role: ConsideredRole) -> dict[ResourceId, Until]:
        """Return until when each candidate of a role is not free, that may be later."""
        found, lost = role.candidacy, each.task.lost
        return {
            one: BY_ITSELF
            if one in lost
            else self._holders.get(found.occupied[one].holder, BY_ITSELF)
            for one in found.resources
            if one in lost or (one in found.occupied and one not in found.excluded)
        }

    def _leave(self, number: str, refusal: "Refusal") -> Iterator[Until]:
        """Return when each of those goes that are in the way of a request."""
        for blocker in refusal.blockers:
            if blocker.lost:
                yield BY_ITSELF
            elif blocker.behavior in self._refusals:
                yield Until({blocker.behavior})
            elif blocker.behavior:
                yield self._holders.get(blocker.behavior, BY_ITSELF)
            else:
                movers = (each for each in self._movers.get(blocker.vehicle, ()) if each != number)
                mover = next(movers, None)
                rests = self._at_rest.get(blocker.vehicle, BY_ITSELF)
                yield rests if mover is None else Until({mover})


def _with_kept(held: Counter[Until], kept: Mapping[ResourceId, str]) -> Counter[Until]:
    if not kept:
        return held
    counts = Counter(kept.values())
    return held + Counter({Until({by}): count for by, count in counts.items()})


def _advice(asking: Sequence[ConsideredRequest], needs: _Needs) -> str:
    """Say what operators can do. The vehicle of a run that is stopped stays where it is: that helps
    if it is in no other one's way."""
    in_way = [vehicle for each in asking for vehicle in needs.in_way(each)]
    runs = [
        each.asked.runner.id
        for each in asking
        if not in_way or ((refusal := needs.refusal(each)) and refusal.vehicle not in in_way)
    ]
    out = f"take {in_way[0]}, drive it out of the way" if in_way else "take what it has"
    way = f"stop one of them (`m2pem stop {runs[-1]}`), or {out}" if runs else out
    return f"none of them can go on by itself. {way[0].upper()}{way[1:]} and give it back"
