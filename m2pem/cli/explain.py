"""`m2pem explain`: why the vehicles and payloads of a task were chosen, or what it waits for."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.completers import runs_of_journal
from m2pem.cli.options import UnusableError, as_json, example, format_option, journal_option
from m2pem.suggestions import suggest
from m2pem.units import US_PER_S

if TYPE_CHECKING:
    from m2pem.api.choices import Candidate, Choice
    from m2pem.api.run_view import RunView
    from m2pem.engine import records as r
    from m2pem.mission.behavior import Behavior, ServiceCall
    from m2pem.mission.elements import Element
    from m2pem.mission.mission import Mission


@click.command(epilog=example("m2pem explain r1 Survey"))
@click.argument("run_id", metavar="RUN", shell_complete=runs_of_journal(ended=True))
@click.argument("element", metavar="ELEMENT")
@journal_option
@format_option
def explain(run_id: str, element: str, journal: str | None, output: str) -> None:
    """Explain which vehicles a task got, and why.

    ELEMENT is a task of the mission: its id or its name. For each time that it chose vehicles or
    payloads, every candidate is listed with its cost, with who held it, or with why it could not
    fill the role. A task that waits says for what, and who has it.
    """
    asyncio.run(_explain(run_id, element, journal, output))


async def _explain(run_id: str, name: str, url: str | None, output: str) -> None:
    from m2pem.api.run_view import RunView
    from m2pem.api.runs import StampedRecord
    from m2pem.cli.journals import find_run, journal_to_read
    from m2pem.executive.run_summary import summary
    from m2pem.journal.mission import present_mission_of

    async with journal_to_read(url) as journal:
        line = await find_run(journal, run_id)
        mission = await present_mission_of(journal, line)
        element = _element(mission, name)
        task = _roles_of(element)
        if task is None or not task.roles:
            raise UnusableError(
                f"{_named(element)} of {run_id} has no roles: vehicles and payloads are given to "
                "tasks with a behavior or service"
            )
        view = RunView(summary(line), mission)
        history = History(element.id)
        async for entry in journal.read(line.run):
            for seq, record in enumerate(entry.records, entry.seq):
                stamped = StampedRecord(line.run, seq, entry.t_us / US_PER_S, record)
                view.apply(stamped)
                history.take(stamped)
    explanation = Explanation(view, element, task, history)
    click.echo(as_json(explanation.as_data()) if output == "json" else explanation.as_text())


def _element(mission: "Mission", name: str) -> "Element":
    """Find an element by its id or name.

    Raises:
        UnusableError: there is none, or several have the name.
    """
    from m2pem.api.description import printable

    if name in mission.elements:
        return mission.elements[name]
    found = [each for each in mission.elements.values() if printable(each.label) == name]
    if len(found) == 1:
        return found[0]
    if found:
        ids = ", ".join(each.id for each in found)
        raise UnusableError(f"several elements of {mission.file} are named {name!r}: say {ids}")
    tasks = [each for each in mission.activities() if _roles_of(each) is not None]
    names = dict.fromkeys(word for each in tasks for word in (each.id, printable(each.label)))
    raise UnusableError(
        f"{mission.file} has no element {name!r}; {suggest(name, names, 'tasks with roles')}"
    )


def _named(element: "Element") -> str:
    from m2pem.api.description import printable

    return (
        element.id if element.label == element.id else f"{printable(element.label)} ({element.id})"
    )


def _roles_of(element: "Element") -> "Behavior | ServiceCall | None":
    return getattr(element, "behavior", None) or getattr(element, "call", None)


@dataclass(slots=True)
class Request:
    """One time that the task asked for resources. Times are mission time in seconds.

    `rest_of`: what was lost before, whose rest the request is for; None: the task begins.
    `instance`: which one of a loop or multi-instance task, from 0. `ends_waiting_s`: when its wait
    is over, None: never, or it does not wait. `resources`: by role, what it got.
    """

    allocation: str
    asked_s: float
    instance: int | None
    ends_waiting_s: float | None
    rest_of: "r.WorkReassigned | None" = None
    delays: "list[tuple[float, r.AllocationDelayed]]" = field(default_factory=list)
    chosen: "tuple[float, r.ResourcesAllocated] | None" = None
    ended: "tuple[float, r.AllocationEnded] | None" = None


@dataclass(slots=True)
class Begun:
    """One time that the task began with resources that the mission names."""

    t_s: float
    instance: int | None
    resources: tuple[str, ...]


class History:
    """What the records of a run say about the resources of one task."""

    def __init__(self, element: str) -> None:
        self.requests: dict[str, Request] = {}
        self.begun: list[Begun] = []
        self._element = element
        self._instances: dict[int, int | None] = {}
        self._due_s: dict[int, float] = {}
        self._lost: dict[int, r.WorkReassigned] = {}

    def take(self, stamped: Any) -> None:
        """Read the next record."""
        from m2pem.engine import records as r

        t_s, record = stamped.t_s, stamped.record
        if getattr(record, "element", self._element) != self._element:
            return
        match record:
            case r.TokenEntered():
                self._instances[record.token] = record.instance
            case r.EventAwaited(due_us=due_us):
                self._due_s[record.wait] = due_us / US_PER_S
            case r.WorkReassigned():
                self._lost[record.token] = record
            case r.AllocationRequested():
                self.requests[record.allocation] = Request(
                    record.allocation,
                    t_s,
                    self._instances.get(record.token),
                    self._due_s.get(record.deadline),
                    self._lost.pop(record.token, None),
                )
            case r.AllocationDelayed() if request := self.requests.get(record.allocation):
                request.delays.append((t_s, record))
            case r.ResourcesAllocated():
                self.requests[record.allocation].chosen = (t_s, record)
            case r.AllocationEnded() if request := self.requests.get(record.allocation):
                request.ended = (t_s, record)
            case r.BehaviorRequested(allocation="") | r.ServiceRequested():
                resources = tuple(each for ids in record.roles.values() for each in ids)
                self.begun.append(Begun(t_s, self._instances.get(record.token), resources))


@dataclass(frozen=True, slots=True)
class Explanation:
    """What is printed about a task. `task`: its behavior or service, with the roles."""

    view: "RunView"
    element: "Element"
    task: "Behavior | ServiceCall"
    history: History

    def as_data(self) -> dict[str, Any]:
        """Return the explanation as JSON values."""
        return {
            "run": self.view.run,
            "element": self.element.id,
            "name": self.element.label,
            "roles": {
                role.name: {"kind": role.kind.value, "resource": role.resource or None}
                for role in self.task.roles
            },
            "requests": [self._request_data(each) for each in self.history.requests.values()],
            "begun": [
                {"t": each.t_s, "instance": each.instance, "resources": each.resources}
                for each in self.history.begun
            ],
        }

    def _request_data(self, request: Request) -> dict[str, Any]:
        chosen, ended = request.chosen, request.ended
        return {
            "allocation": request.allocation,
            "instance": request.instance,
            "asked": request.asked_s,
            "waits_until": request.ends_waiting_s,
            "waiting": self._is_waiting(request),
            "rest_of": request.rest_of
            and {
                "behavior": request.rest_of.behavior,
                "code": request.rest_of.code,
                "reason": request.rest_of.reason,
                "parameters": request.rest_of.parameters,
            },
            "delays": [
                {"t": t_s, "reason": each.reason, "holders": each.holders, "again": each.again}
                for t_s, each in request.delays
            ],
            "chosen": chosen
            and {
                "t": chosen[0],
                "roles": chosen[1].roles,
                "considered": self._considered(chosen[1]),
            },
            "ended": ended and {"t": ended[0], "code": ended[1].code, "reason": ended[1].reason},
        }

    def _considered(self, record: "r.ResourcesAllocated") -> dict[str, Any]:
        """Return what a choice considered, with `why_not` of each candidate that was not chosen."""
        import msgspec

        from m2pem.api.choices import choice_of, why_not

        choice = choice_of(record)
        return {
            "roles": {
                name: {
                    **msgspec.to_builtins(role),
                    "candidates": [
                        {
                            **msgspec.to_builtins(each),
                            "why_not": ""
                            if each.resource in role.chosen
                            else why_not(each, choice, name, self.view.holder),
                        }
                        for each in role.candidates
                    ],
                }
                for name, role in choice.roles.items()
            },
            "together_with": choice.together_with,
        }

    def _is_waiting(self, request: Request) -> bool:
        return request.allocation in self.view.allocations and not self.view.status.ended

    def as_text(self) -> str:
        """Return the explanation as text."""
        named = [role for role in self.task.roles if role.resource]
        parts = [f"{_named(self.element)} of {self.view.run}"]
        parts += [
            f"role {role.name}: the mission names the {role.kind.value} {role.resource}"
            for role in named
        ]
        parts += [
            f"at {each.t_s:.1f} s{_instance(each.instance)}: begins with "
            f"{', '.join(each.resources)}"
            for each in self.history.begun
        ]
        parts += [self._request_text(each) for each in self.history.requests.values()]
        if not self.history.begun and not self.history.requests:
            parts.append(
                "the task has not asked for vehicles or payloads"
                if self.view.status.ended
                else "the task has not asked for vehicles or payloads yet"
            )
        return "\n".join(parts)

    def _request_text(self, request: Request) -> str:
        from m2pem.api.description import printable, waiting

        asked = f"\nat {request.asked_s:.1f} s{_instance(request.instance)}: asks"
        lines = [f"{asked} for resources ({request.allocation})"]
        if (lost := request.rest_of) is not None:
            why = f"{lost.code}: {lost.reason}" if lost.reason else lost.code
            left = f", to do what {self.view.holder(lost.behavior)} left, {printable(why)}"
            lines[0] += left
        for t_s, delay in request.delays:
            what = f"asks again, as {delay.reason}" if delay.again else waiting(delay.reason)
            lines.append(f"at {t_s:.1f} s: {printable(what)}")
        if request.chosen is not None:
            lines.append(self._chosen_text(request, *request.chosen))
        elif request.ended is not None:
            t_s, ended = request.ended
            how = f"{ended.code}: {ended.reason}" if ended.code else "the task was interrupted"
            lines.append(f"at {t_s:.1f} s: got nothing, {printable(how)}")
        elif self._is_waiting(request):
            lines.append(self._waiting_text(request))
        return "\n".join(lines)

    def _waiting_text(self, request: Request) -> str:
        from m2pem.cli.table import table

        until = request.ends_waiting_s
        limit = "without a limit" if until is None else f"until {until:.1f} s at the latest"
        since = f"it waits at {self.view.t_s:.1f} s, the last record, and {limit}"
        holders = self.view.allocations[request.allocation].holders
        if not holders:
            return since
        rows = [(resource, self.view.holder(holder)) for resource, holder in holders.items()]
        return f"{since}\n\n{table(('RESOURCE', 'HELD BY'), rows)}"

    def _chosen_text(self, request: Request, t_s: float, record: "r.ResourcesAllocated") -> str:
        from m2pem.api.choices import choice_of

        choice = choice_of(record)
        waited_s = t_s - request.asked_s
        after = f", after {waited_s:.1f} s" if request.delays else ""
        parts = [f"at {t_s:.1f} s: gets resources{after}"]
        if choice.together_with:
            others = ", ".join(map(self.view.holder, choice.together_with))
            parts[0] += f"; decided together with {others}"
        return "\n".join([*parts, *(self._role_text(choice, name) for name in choice.roles)])

    def _role_text(self, choice: "Choice", name: str) -> str:
        from m2pem.api.choices import how_chosen, why_not
        from m2pem.cli.table import table

        role = choice.roles[name]
        rows = [
            (
                each.resource,
                *_costs(each),
                how_chosen(each, self.view.holder)
                if each.resource in role.chosen
                else why_not(each, choice, name, self.view.holder),
            )
            for each in role.candidates
        ]
        more = f"\nand {role.not_listed} others" if role.not_listed else ""
        chosen = ", ".join(role.chosen) or "nothing is free, and the role is optional"
        if not rows:
            return f"\nrole {name}: {chosen}"
        return f"\nrole {name}: {chosen}\n{table(COLUMNS, rows)}{more}"


COLUMNS = ("CANDIDATE", "COST", "TRAVEL", "BATTERY", "SWITCHING", "PREFERENCE", "WHY")


def _costs(each: "Candidate") -> Sequence[str]:
    """Return the cost of a candidate and its parts, in seconds; "-" for one that is excluded."""
    if each.cost_s is None:
        return ("-",) * 5
    travel = "not known"
    if each.travel_s is not None:
        far = f" ({each.distance_m:.0f} m)" if each.distance_m else ""
        travel = f"{each.travel_s:.1f} s{far}"
    charge = "" if each.battery is None else f" ({each.battery:.0%})"
    return (
        f"{each.cost_s:.1f} s",
        travel,
        f"{each.battery_s:.1f} s{charge}",
        f"{each.switching_s:.1f} s",
        f"{0.0 - each.preference_s:.1f} s",
    )


def _instance(instance: int | None) -> str:
    return "" if instance is None else f", instance {instance}"
