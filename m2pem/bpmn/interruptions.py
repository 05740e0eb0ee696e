"""What can interrupt the tokens of a container, whatever they do: events beside and around them."""

from collections.abc import Iterator
from functools import cached_property

from m2pem.mission.elements import Activity, CallActivity, Container, FlowNode, Process, SubProcess
from m2pem.mission.events import CompensateEventDefinition
from m2pem.mission.mission import Mission


class Surroundings:
    """The containers around each container of a mission, and the events that interrupt them."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission

    def of(self, inner: Container) -> Iterator[tuple[Container, list[FlowNode]]]:
        """The container and those around it, the inner ones first; each with what interrupts it.

        That is its event subprocesses whose start interrupts, and interrupting boundary events of
        the subprocess that it is, or of the activities that call it.
        """
        found = [inner]
        for container in found:  # grows while it is read
            around: list[Activity] = (
                [container]
                if isinstance(container, SubProcess)
                else list(self._callers.get(container, []))
            )
            events: list[FlowNode] = [
                each
                for each in container.event_subprocesses
                if each not in found and any(start.interrupting for start in each.starts)
            ]
            events += [
                event
                for activity in around
                for event in activity.boundary
                if event.interrupting
                and not any(isinstance(e, CompensateEventDefinition) for e in event.definitions)
            ]
            yield container, events
            found += [each.container for each in around if each.container not in found]

    @cached_property
    def _callers(self) -> dict[Process, list[CallActivity]]:
        found: dict[Process, list[CallActivity]] = {}
        for node in self._mission.nodes:
            if isinstance(node, CallActivity):
                found.setdefault(node.called, []).append(node)
        return found
