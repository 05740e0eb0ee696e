"""What the names in formulas and arguments refer to, in one mission and its fleet.

That includes the names of the data store that a mission reads or writes anywhere.
"""

from collections.abc import Iterable, Mapping, Sequence

from m2pem.bpmn.data_names import read_by, stored_by
from m2pem.errors import ExpressionSyntaxError
from m2pem.fleet.allocation import resources_of, spelled_out
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.elements import FlowNode, UserTask
from m2pem.mission.expression import Expression
from m2pem.mission.mission import Mission
from m2pem.suggestions import suggest
from m2pem.verify.ltl.formula import (
    Active,
    Commanded,
    Completed,
    Data,
    Formula,
    Measured,
    rebuilt,
)


def data_names(
    mission: Mission, service_writes: Mapping[str, Sequence[str]] | None = None
) -> frozenset[str]:
    """Names that are written, or that conditions, parameters and mappings read.

    `service_writes`: what services write, by class.
    """
    found: set[str] = {*mission.associated, *mission.data_stores}
    for process in mission.processes:
        found.update(each.key for each in process.data)
    for flow in mission.flows:
        if flow.condition is not None:
            found |= flow.condition.names
    for node in mission.nodes:
        found |= written_by(node, service_writes or {}) | read_by(node)
    return frozenset(name for name in found if name)


def written_by(node: e.FlowNode, services: Mapping[str, Sequence[str]]) -> set[str]:
    """Names that a node writes, or declares; `services`: what services write, by class."""
    written = stored_by(node)
    if isinstance(node, e.SubProcess):
        written.update(each.key for each in node.data)
    if isinstance(node, e.ServiceTask) and node.call is not None:
        written.update(services.get(node.call.service, ()))
    behavior = getattr(node, "behavior", None)
    if behavior is not None and (behavior.name, behavior.type) in SHARED:
        written.update(SHARED[behavior.name, behavior.type].writes)
    return written


_WHERE = ("area", "route", "target")


class UnknownNameError(ValueError):
    """A name that refers to nothing here; the message suggests what was meant."""


class Names:
    """The elements, resources, behaviors and data of a mission on a fleet."""

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet,
        service_writes: Mapping[str, Sequence[str]] | None = None,
        data: Iterable[str] = (),
    ) -> None:
        """`service_writes`: what services write, by class. `data`: names with a value
        at the start.
        """
        self.mission = mission
        self.fleet = fleet
        self.data_names = data_names(mission, service_writes) | frozenset(data)
        self.labels = {each.id: each.name for each in (*mission.nodes, *mission.processes)}
        self._by_name: dict[str, list[str]] = {}
        for identifier, name in self.labels.items():
            if name:
                self._by_name.setdefault(name, []).append(identifier)
        self._tasks = [
            (node, behavior)
            for node in mission.nodes
            if isinstance(behavior := getattr(node, "behavior", None), Behavior)
        ]

    # --- single names ---------------------------------------------------------------------------

    def element(self, name: str) -> str:
        """The id of an element, given its id or name.

        Raises:
            UnknownNameError: there is none, or there are several of that name.
        """
        if name in self.labels:
            return name
        found = self._by_name.get(name, [])
        if len(found) == 1:
            return found[0]
        if found:
            raise UnknownNameError(f"several elements are called '{name}': {', '.join(found)}")
        if name in self.mission.elements:
            raise UnknownNameError(f"'{name}' is a sequence flow; name an element that it leads to")
        known = [*self._by_name, *self.labels]
        raise UnknownNameError(
            f"the mission has no element '{name}'; {suggest(name, known, 'elements')}"
        )

    def resource(self, name: str) -> str:
        """A vehicle, payload or team.

        Raises:
            UnknownNameError: the fleet has none.
        """
        known = [*self.fleet.vehicles, *self.fleet.payloads, *self.fleet.teams]
        if name in known:
            return name
        raise UnknownNameError(
            f"the fleet has no vehicle, payload or team '{name}'; "
            f"{suggest(name, known, 'vehicles, payloads and teams')}"
        )

    def vehicle(self, name: str) -> str:
        """A vehicle, of which telemetry says where it is.

        Raises:
            UnknownNameError: the fleet has none of that name.
        """
        if name in self.fleet.vehicles:
            return name
        raise UnknownNameError(
            f"the fleet has no vehicle '{name}'; {suggest(name, self.fleet.vehicles, 'vehicles')}"
        )

    def behavior(self, name: str) -> str:
        """A behavior that the mission uses, or that all arbiters share.

        Raises:
            UnknownNameError: no such behavior is known.
        """
        used = list(dict.fromkeys(behavior.name for _, behavior in self._tasks))
        shared = [shared_name for shared_name, _ in SHARED]
        if name in used or name in shared:
            return name
        known = list(dict.fromkeys([*used, *shared]))
        raise UnknownNameError(
            f"there is no behavior '{name}'; {suggest(name, known, 'behaviors')}"
        )

    def decision(self, task: str, value: str) -> str:
        """A decision that the user task offers.

        Raises:
            UnknownNameError: it does not offer that.
        """
        prompt = self._user_task(task).prompt
        known = [each.value for each in prompt.decisions] if prompt else []
        if value in known:
            return value
        hint = suggest(value, known, "decisions")
        raise UnknownNameError(f"'{task}' has no decision '{value}'; {hint}")

    def store_of(self, task: str) -> str:
        """The name to which a user task's decision is written."""
        prompt = self._user_task(task).prompt
        return prompt.store if prompt else ""

    def _user_task(self, task: str) -> UserTask:
        node = self.mission.elements.get(task)
        if isinstance(node, UserTask):
            return node
        known = [each.id for each in self.mission.nodes if isinstance(each, UserTask)]
        raise UnknownNameError(f"'{task}' is no user task; {suggest(task, known, 'user tasks')}")

    def vehicles(self) -> tuple[str, ...]:
        """Every vehicle of the fleet, in its order."""
        return tuple(self.fleet.vehicles)

    def members(self, resource: str) -> frozenset[str]:
        """The resources that are held when a resource is: a team's members, else itself."""
        team = self.fleet.teams.get(resource)
        return frozenset(spelled_out(team)) if team else frozenset({resource})

    def places_of(self, resource: str, behavior: str) -> Mapping[str, Sequence[str]]:
        """The tasks in which a resource does a behavior, by location."""
        found: dict[str, list[str]] = {}
        for node, each in self._tasks:
            if each.name == behavior and self.members(resource) <= self._held(each):
                found.setdefault(_where(node, each), []).append(node.id)
        return found

    def _held(self, behavior: Behavior) -> frozenset[str]:
        return frozenset(r for role in behavior.roles for r in resources_of(role, self.fleet))

    # --- formulas -------------------------------------------------------------------------------

    def resolved(self, formula: Formula, text: str) -> Formula:
        """The formula with ids in place of the names in it. `text`: the text that positions refer
        to.

        Raises:
            ExpressionSyntaxError: a name refers to nothing; it points at the name.
        """

        def resolve(each: Formula) -> Formula:
            try:
                match each:
                    case Active() | Completed():
                        return type(each)(self.element(each.element), each.position)
                    case Commanded():
                        self.resource(each.resource)
                        at = each.behavior_position
                        if each.behavior:
                            self._commanded(each, text)
                        return Commanded(each.resource, each.behavior, each.position, at)
                    case Data():
                        self._data(each.expression)
                        return each
                    case Measured():
                        for resource in each.resources:
                            self.vehicle(resource)
                        return each
                    case _:
                        return rebuilt(each, resolve)
            except UnknownNameError as error:
                position = getattr(each, "position", 0)
                raise ExpressionSyntaxError(str(error), text, position) from None

        return resolve(formula)

    def _commanded(self, each: Commanded, text: str) -> None:
        try:
            self.behavior(each.behavior)
        except UnknownNameError as error:
            raise ExpressionSyntaxError(str(error), text, each.behavior_position) from None

    def _data(self, expression: Expression) -> None:
        for name in sorted(expression.names):
            if name in self.mission.elements or name in self._by_name:
                raise UnknownNameError(
                    f"'{name}' is an element: write active({name}) or completed({name})"
                )
            known = sorted(self.data_names)
            parts = name.split(".")
            if not any(".".join(parts[: n + 1]) in known for n in range(len(parts))):
                raise UnknownNameError(
                    f"the mission has no data '{name}'; {suggest(name, known, 'data')}"
                )


def _where(node: FlowNode, behavior: Behavior) -> str:
    for parameter in behavior.parameters:
        if parameter.name in _WHERE and isinstance(parameter.value, str):
            return f"{parameter.name} {parameter.value}"
    return f"task {node.id}"
