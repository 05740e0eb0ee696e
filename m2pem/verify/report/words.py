"""Calls elements of a mission what their author calls them."""

from collections.abc import Mapping, Sequence

from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.events import RootElement
from m2pem.mission.mission import Mission


class Words:
    """Names of what is in a mission, by id."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission

    def name(self, element: str) -> str:
        """A name for a text: that of the diagram, else of the flow's ends, else kind and id."""
        known = self.mission.elements.get(element)
        if known is None:
            return element
        if known.name:
            return _one_line(known.label)
        if isinstance(known, e.SequenceFlow):
            return f"{_one_line(known.source.label)} \u2192 {_one_line(known.target.label)}"
        return f"{known.kind} {known.id}"

    def with_id(self, element: str) -> str:
        """The name, and the id where the name does not say it."""
        name = self.name(element)
        if name.endswith(f" {element}") or _letters(name) == _letters(element):
            return name
        return f"{name} ({element})"

    def all_of(self, elements: Sequence[str]) -> str:
        """Several names in a text."""
        names = list(dict.fromkeys(self.name(each) for each in elements))
        if len(names) < 2:
            return "".join(names)
        return f"{', '.join(names[:-1])} and {names[-1]}"

    def thrown(self, ref: str) -> str:
        """A signal, message, error or escalation, by its id or code."""
        mission = self.mission
        groups: tuple[tuple[str, Mapping[str, RootElement]], ...] = (
            ("signal", mission.signals),
            ("message", mission.messages),
            ("escalation", mission.escalations),
            ("error", mission.errors),
        )
        for what, known in groups:
            if ref in known:
                return f"the {what} '{_one_line(known[ref].name) or ref}'"
        for error in mission.errors.values():
            if error.code == ref:
                return f"the error '{_one_line(error.name) or ref}'"
        for escalation in mission.escalations.values():
            if escalation.code == ref:
                return f"the escalation '{_one_line(escalation.name) or ref}'"
        return f"'{ref}'" if ref else ""

    def behavior(self, element: str) -> str:
        """What a task commands: who begins what; "" for nothing."""
        behavior = getattr(self.mission.elements.get(element), "behavior", None)
        if not isinstance(behavior, Behavior):
            return ""
        who = ", ".join(role.resource for role in behavior.roles if role.resource)
        return f"{who} begins {behavior.name}" if who else f"begins {behavior.name}"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _letters(text: str) -> str:
    return "".join(each for each in text.casefold() if each.isalnum())
