"""Circles of runs and tasks that wait for each other: found when they close, said to operators."""

from collections import Counter
from collections.abc import Callable, Container, Mapping, Sequence
from typing import TYPE_CHECKING

from m2pem.allocation.circles import Waiting, circles
from m2pem.allocation.needs import ConsideredRole
from m2pem.api.runs import Alert, RunId
from m2pem.engine.state import BehaviorPhase
from m2pem.executive.allocation_requests import ConsideredRequest
from m2pem.executive.runner import Runner
from m2pem.executive.space_allocation import space_circle_text, space_circles
from m2pem.executive.waiting_tasks import holder_label
from m2pem.fleet.behaviors import ENDING_PARAMETERS
from m2pem.fleet.graph import ResourceGraph
from m2pem.mission.behavior import BehaviorType

if TYPE_CHECKING:
    from m2pem.deconfliction.conflicts import Refusal


class WaitingCircles:
    """Warns operators of each circle once. `runners`: the runs that are driven here."""

    def __init__(
        self,
        runners: Mapping[RunId, Runner],
        graph: ResourceGraph,
        publish: Callable[[Alert], None],
    ) -> None:
        self._runners = runners
        self._graph = graph
        self._publish = publish
        self._known: set[frozenset[str]] = set()

    def look(
        self,
        left: Sequence[ConsideredRequest],
        refusals: Mapping[str, "Refusal"],
    ) -> None:
        """Warn operators of runs and tasks that wait for each other, once for each circle.

        `left`: all that waits. `refusals`: why some of it has no space; the rest waits for
        resources.
        """
        waiting = [each for each in left if each.request.id not in refusals]
        requests = {each.request.id: each for each in left} if refusals else {}
        vehicles = {number: each.named_vehicles for number, each in requests.items()}
        certain = {  # a task that may get another vehicle need not wait for ever
            number: refusal
            for number, refusal in refusals.items()
            if all(role.named for role in requests[number].roles)
        }
        in_space = space_circles(certain, vehicles)
        for circle in in_space:
            if circle not in self._known:
                asking = {number: requests[number].request for number in sorted(circle)}
                text = space_circle_text(asking, refusals, self._who)
                for run in sorted({requests[number].asked.runner.id for number in circle}):
                    self._publish(Alert(run, "WAITING_CIRCLE", text))
        runners = {each.asked.runner.id: each.asked.runner for each in waiting if each.waits}
        idle = {run: runner for run, runner in runners.items() if self._is_idle(runner)}
        found = circles(_asked(waiting, idle))
        for circle in found:
            if circle not in self._known:
                text = self._text([each for each in waiting if each.asked.runner.id in circle])
                for run in sorted(circle):
                    self._publish(Alert(run, "WAITING_CIRCLE", text))
        self._known = {*found, *in_space}

    def _goes_on(self, holder: str) -> bool:
        """Whether a behavior ends only when its run ends it, as what a run keeps does."""
        runner = self._runners.get(holder.partition(".")[0])
        if runner is None:
            return False
        if any(each.id == holder for each in runner.run.state.kept.values()):
            return True
        known = runner.run.state.behaviors.get(holder)
        if known is None or known.phase is not BehaviorPhase.ACTIVE:
            return False
        if not ENDING_PARAMETERS.isdisjoint(known.parameters):
            return False
        kind = BehaviorType(known.type)
        spec = self._graph.spec(known.resources[0], known.name, kind)
        return spec is not None and not spec.ends

    def _is_idle(self, runner: Runner) -> bool:
        """Whether a run can go on only by getting what it asked for."""
        state = runner.run.state
        limits = {request.deadline for request in state.allocations.values()}
        if limits != {0} or state.prompts or state.services or state.waits or state.incidents:
            return False
        return all(self._goes_on(behavior) for behavior in state.behaviors)

    def _who(self, holder: str) -> str:
        """Return what holds something in words: its task, run and mission."""
        return holder_label(self._runners, holder, mission=True) or holder

    def _text(self, waiting: Sequence[ConsideredRequest]) -> str:
        said = [
            f"{self._who(each.request.id)} waits for "
            + ", ".join(
                f"{resource} (held by {self._who(role.occupied[resource].holder)})"
                for role in each.roles
                for resource in role.options.busy
            )
            for each in waiting
        ]
        runs = [each.asked.runner.id for each in waiting]
        return (
            f"{'; '.join(said)}: none of them can go on by itself. Stop one of them (`m2pem stop "
            f"{runs[-1]}`), or take what it has and give it back"
        )


def _asked(waiting: Sequence[ConsideredRequest], idle: Mapping[RunId, Runner]) -> list[Waiting]:
    """Return the requests of runs that can go on only by getting what they asked for.

    `idle`: these runs. What others have becomes free by itself.
    """
    idle_holders = {
        holder: run
        for run, runner in idle.items()
        for holder in (
            *runner.run.state.behaviors,
            *(kept.id for kept in runner.run.state.kept.values()),
        )
    }
    known: dict[int, Counter[str | None]] = {}

    def needed(role: ConsideredRole, lost: Container[str]) -> tuple[int, Mapping[str | None, int]]:
        """How many it lacks, and how many each run has. What the task has lost may return by
        itself; it shares its candidates with no other task."""
        found = role.candidacy
        if id(found) not in known:
            known[id(found)] = Counter(
                None if each in lost else idle_holders.get(found.occupied[each].holder)
                for each in found.resources
                if each in lost or (each in found.occupied and each not in found.excluded)
            )
        return max(0, role.options.least - len(role.options.costs_s)), known[id(found)]

    return [
        Waiting(each.request.id, run, tuple(needed(role, each.task.lost) for role in each.roles))
        for each in waiting
        if (run := each.asked.runner.id) in idle
    ]
