"""A run of the net as numbered steps, in the words of the diagram."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.events import RootElement
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.net import choices
from m2pem.verify.net.encoding import Encoding, Marking
from m2pem.verify.net.petri_net import (
    BEGINS,
    COMPENSATION_BEGINS,
    COMPENSATION_ENDS,
    REASSIGNED,
    Action,
    Kind,
    PetriNet,
    Step,
    Transition,
    Trigger,
)


class ElementNames:
    """Names of what is in a mission, by id."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self._with_id: dict[str, str] = {}

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
        """The name, and the id where the name does not contain it."""
        if element not in self._with_id:
            name = self.name(element)
            same = name.endswith(f" {element}") or _letters(name) == _letters(element)
            self._with_id[element] = name if same else f"{name} ({element})"
        return self._with_id[element]

    def all_of(self, elements: Sequence[str]) -> str:
        """Several names in a text."""
        names = list(dict.fromkeys(self.name(each) for each in elements))
        if len(names) < 2:
            return "".join(names)
        return f"{', '.join(names[:-1])} and {names[-1]}"

    def thrown(self, ref: str) -> str:
        """The name of a signal, message, error or escalation, by its id or code."""
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
        """Return which resource begins which behavior at a task; "" for none."""
        behavior = getattr(self.mission.elements.get(element), "behavior", None)
        if not isinstance(behavior, Behavior):
            return ""
        who = ", ".join(role.resource for role in behavior.roles if role.resource)
        return f"{who} begins {behavior.name}" if who else f"begins {behavior.name}"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _letters(text: str) -> str:
    return "".join(each for each in text.casefold() if each.isalnum())


COMMANDS = "commands"
"""Detail of the step in which a task's behavior is requested, after the task was entered."""
_NUMBERED = re.compile(r"(#\d+|\[\d+\])$")
_ROOM_BITS = 8
_SAME = -1
"""Index of a part that belongs to the transition before it."""


@dataclass(frozen=True, slots=True)
class Token:
    """Tokens on an element. `flow`: the flow by which they came to a join; "" otherwise."""

    element: str
    count: int
    flow: str = ""

    def as_data(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {"element": self.element, "count": self.count, "waits": bool(self.flow)}


@dataclass(frozen=True, slots=True)
class RunStep:
    """A step of a run, numbered from 1.

    `passes`: elements and flows that it passes; its number is shown at the first. `element`: the
    element that it belongs to. `transitions`: those that it consists of. `trigger`: what came from
    outside, "" for nothing. `actions`: what happens to elements. `tokens`: where they are after it.
    `data`: the values after it, by names with the calls that they are in before them; `writes`:
    what came with the trigger, under the names that the mission has for it.
    """

    number: int
    text: str
    element: str
    passes: tuple[str, ...]
    transitions: tuple[int, ...]
    trigger: str
    detail: str
    actions: tuple[Step, ...]
    tokens: tuple[Token, ...]
    data: Mapping[str, Value]
    writes: Mapping[str, Value]

    def as_data(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {
            "step": self.number,
            "text": self.text,
            "element": self.element,
            "passes": [*self.passes],
            "trigger": self.trigger or None,
            "detail": self.detail,
            "actions": [
                {"element": each.element, "action": each.action.value, "detail": each.detail}
                for each in self.actions
            ],
            "tokens": [each.as_data() for each in self.tokens],
            "data": dict(self.data),
            "writes": dict(self.writes),
            "rules": [*self.transitions],
        }


def describe_run(
    encoding: Encoding,
    element_names: ElementNames,
    run: Sequence[int],
    *,
    begin: int = 0,
    at: int | None = None,
    for_people: bool = True,
) -> tuple[tuple[RunStep, ...], int]:
    """Describe a run, and return the state in which it ends too.

    `encoding`: that of `encoding_of`. `begin`: how many steps were described before; `at`: the
    state that those led to, None for the first. `for_people`: else the steps have neither texts nor
    tokens.
    """
    state = encoding.initial if at is None else at
    run_step: list[RunStep] = []
    waiting: list[Transition] = []
    transitions = [part for index in run for part in _parts(encoding.net.transitions[index])]
    commanded = _commanded_later(transitions)
    for number, transition in enumerate(transitions):
        if transition.index != _SAME:
            state, _ = encoding.fire(transition.index, state)
        if number in commanded.values():
            continue
        if number in commanded:
            waiting.append(transitions[commanded[number]])
        waiting.append(transition)
        if number + 1 < len(transitions) and _same_step(transition, transitions[number + 1]):
            continue
        if any(each.steps for each in waiting):
            after = begin + len(run_step) + 1
            run_step.append(
                _run_step(after, waiting, element_names, encoding, state, for_people=for_people)
            )
            waiting = []
    return tuple(run_step), state


def _parts(transition: Transition) -> list[Transition]:
    """The parts of a transition that are steps of their own: a fused transition has several."""
    groups: list[list[Step]] = []
    for step in transition.steps:
        moved_on = groups and groups[-1][-1].action is Action.TAKEN
        again = step.action in (Action.COMPLETED, Action.ENTERED)
        if not groups or (moved_on and again) or _beside(groups[-1][-1], step):
            groups.append([])
        groups[-1].append(step)
    if len(groups) < 2:
        return [transition]
    first = replace(transition, steps=tuple(groups[0]))
    later = [
        replace(
            transition, index=_SAME, steps=tuple(group), kind=Kind.INTERNAL, trigger=None, assign=()
        )
        for group in groups[1:]
    ]
    return [first, *later]


def _beside(one: Step, other: Step) -> bool:
    """Whether another element is entered: the branches of a fork begin separately."""
    return one.action is other.action is Action.ENTERED and one.element != other.element


def _commanded_later(transitions: Sequence[Transition]) -> dict[int, int]:
    """By index in the run of each step in which a task begins its work: where the task was entered.

    To people that is one step, also when others are in between.
    """
    entered: dict[str, int] = {}
    found: dict[int, int] = {}
    for number, transition in enumerate(transitions):
        if not transition.steps:
            continue
        first = transition.steps[0]
        if len(transition.steps) == 1 and first.detail in (COMMANDS, BEGINS):
            if first.element in entered:
                found[number] = entered.pop(first.element)
        elif (
            len(transition.steps) == 1
            and first.action is Action.ENTERED
            and transition.trigger is None
        ):
            entered[first.element] = number
        else:
            for step in transition.steps:
                entered.pop(step.element, None)
    return found


def encoding_of(net: PetriNet) -> Encoding:
    """An encoding with room for several tokens on every place, so that every run can
    be followed.
    """
    return Encoding(net, {place.index: _ROOM_BITS for place in net.places})


def tokens_of(net: PetriNet, marking: Marking) -> tuple[Token, ...]:
    """Return the mission's tokens, without those that only the net needs."""
    found: dict[tuple[str, str], int] = {}
    for index, count in marking.tokens.items():
        place = net.places[index]
        if place.role in ("control", "end"):
            continue
        known = place.element
        key = (known, known) if place.role == "flow" else (known, "")
        found[key] = found.get(key, 0) + count
    return tuple(Token(element, count, flow) for (element, flow), count in found.items())


def _data_of(net: PetriNet, marking: Marking) -> dict[str, Value]:
    """The values of all followed names."""
    values = marking.values
    return {
        variable.name: variable.values[values[variable.index]]
        for variable in net.variables
        if variable.index in values
    }


def _same_step(transition: Transition, following: Transition) -> bool:
    """Whether two transitions are one step to people: an event is triggered, and goes on."""
    if not transition.steps or not following.steps:
        return not transition.steps
    second = following.steps[0]
    if second.action is Action.STANDS:
        return True
    before = {step.action for step in transition.steps if step.element == second.element}
    again = second.action is Action.COMPLETED and Action.TRIGGERED in before
    return again and following.trigger is None


def _run_step(
    number: int,
    transitions: Sequence[Transition],
    element_names: ElementNames,
    encoding: Encoding,
    state: int,
    *,
    for_people: bool,
) -> RunStep:
    transition = next((each for each in transitions if each.trigger is not None), transitions[-1])
    actions = tuple(dict.fromkeys(step for each in transitions for step in each.steps))
    element = next(each for each in transitions if each.steps).element
    taken = [step.element for step in actions if step.action is Action.TAKEN]
    others = [step.element for step in actions if step.action is not Action.TAKEN]
    writes, marking = _writes(transition, element_names, encoding.net), encoding.marking(state)
    return RunStep(
        number,
        _sentence(transition, actions, element_names, writes) if for_people else "",
        element,
        tuple(dict.fromkeys([*taken, *others])),
        tuple(each.index for each in transitions if each.index != _SAME),
        transition.trigger.value if transition.trigger is not None else "",
        transition.detail,
        actions,
        tokens_of(encoding.net, marking) if for_people else (),
        _data_of(encoding.net, marking),
        writes,
    )


def _writes(transition: Transition, element_names: ElementNames, net: PetriNet) -> dict[str, Value]:
    """Return the data of a trigger."""
    if transition.trigger is None:
        return {}
    return {
        _local(element_names, net.variables[variable].name): net.variables[variable].values[value]
        for variable, value in transition.assign
    }


def _local(element_names: ElementNames, name: str) -> str:
    """A variable's name without the calls and processes that it is in."""
    parts = name.split(".")
    while len(parts) > 1 and _NUMBERED.sub("", parts[0]) in element_names.mission.elements:
        parts = parts[1:]
    return ".".join(parts)


# --- sentences ------------------------------------------------------------------------------------


def _sentence(
    transition: Transition,
    actions: Sequence[Step],
    element_names: ElementNames,
    writes: Mapping[str, Value],
) -> str:
    element = actions[0].element
    name = element_names.with_id(element)
    failed = transition.trigger is Trigger.FAILS
    if transition.trigger is not None:
        said = _from_outside(transition, name, element_names)
        if transition.trigger is not Trigger.ANSWER and writes:
            values = " and ".join(f"{key} = {value!r}" for key, value in writes.items())
            said += f", with {values}"
    else:
        said = _internal(actions[0], actions, element_names)
    parts = [said, *_besides(element, actions, element_names, failed=failed)]
    return "; ".join(part for part in parts if part)


def _from_outside(transition: Transition, name: str, element_names: ElementNames) -> str:
    match transition.trigger:
        case Trigger.SUCCEEDS:
            return f"{name} succeeds"
        case Trigger.FAILS if transition.detail == REASSIGNED:
            return f"what does {name} is lost, and another is to do the rest"
        case Trigger.FAILS:
            return f"{name} fails with {transition.detail or 'an error'}"
        case Trigger.ANSWER:
            return f"{name}: the operator answers '{transition.detail}'"
        case Trigger.TIMER:
            return f"{name}: the time is up"
        case Trigger.SIGNAL | Trigger.MESSAGE:
            return f"{name}: {element_names.thrown(transition.detail)} comes"
        case Trigger.CONDITION:
            return f"{name}: its condition becomes true"
        case _:
            return f"{name}: {transition.detail}" if transition.detail else name


def _internal(first: Step, actions: Sequence[Step], element_names: ElementNames) -> str:
    node = element_names.mission.elements.get(first.element)
    name = element_names.with_id(first.element)
    taken = [step.element for step in actions if step.action is Action.TAKEN]
    if isinstance(node, e.Gateway) and taken:
        flow = element_names.mission.elements.get(taken[0])
        if len(taken) == 1 and flow is not None and flow.name:
            return f"{name}: {element_names.name(taken[0])}"
        return f"{name}: on to {_targets(element_names, taken)}"
    match first.action:
        case Action.ENTERED if isinstance(node, e.UserTask):
            return f"{name} asks the operator"
        case Action.ENTERED:
            commands = element_names.behavior(first.element)
            commanded = any(step.detail == COMMANDS for step in actions)
            return f"{name}: {commands}" if commands and commanded else f"{name} begins"
        case Action.ALLOCATED if first.detail:
            given = choices.in_words(choices.read(first.detail)).rstrip(",")
            return f"{name} is given {given}"
        case Action.ALLOCATED:
            return f"{name} gets nothing: too few of what could fill its roles are free"
        case Action.PASSED_OVER:
            return f"{name} gets nothing: {element_names.name(first.detail)} may keep what is free"
        case Action.LEFT:
            return f"the vehicle of {name} has left {first.detail}"
        case Action.REFUSED:
            return f"{name} gets nothing: {first.detail} is full"
        case Action.RELEASED:
            return f"nothing is left to do in {name}: it keeps nothing more"
        case Action.STANDS:
            return first.detail or "a vehicle has stopped"
        case Action.INTERRUPTED | Action.THROWN:
            return ""
        case Action.TRIGGERED:
            compensation = first.detail in (COMPENSATION_BEGINS, COMPENSATION_ENDS)
            return f"{name} {first.detail if compensation else 'is triggered'}"
        case Action.COMPLETED if isinstance(node, e.EndEvent):
            return f"{name} is reached"
        case Action.COMPLETED if isinstance(node, e.StartEvent):
            return f"{name}: on to {_targets(element_names, taken)}"
        case Action.COMPLETED if isinstance(node, e.IntermediateThrowEvent) and any(
            step.action is Action.THROWN for step in actions
        ):
            return ""
        case Action.COMPLETED:
            return f"{name} is over"
        case _:
            return f"{name} \u2192"


def _besides(
    element: str, actions: Sequence[Step], element_names: ElementNames, *, failed: bool = False
) -> list[str]:
    """Return the other effects of a step: it throws, interrupts, triggers."""
    said = []
    for place, step in enumerate(actions):
        name = element_names.name(step.element)
        if step.action is Action.THROWN:
            if failed and step.element == element:
                continue
            what = element_names.thrown(step.detail) if step.detail else "its error"
            said.append(f"{name} throws {what}")
        elif step.action is Action.STANDS and step.detail and place:
            said.append(step.detail)
        elif step.action is Action.REFUSED and place:
            said.append(f"{step.detail} is full")
        elif step.action is Action.INTERRUPTED:
            said.append(f"{name} is interrupted")
        elif step.action is Action.TRIGGERED and place and step.element != element:
            said.append(f"{element_names.with_id(step.element)} is triggered")
        elif step.action is Action.COMPLETED and place and step.element != element:
            said.append(f"{name} is over")
    return list(dict.fromkeys(said))


def _targets(element_names: ElementNames, flows: Sequence[str]) -> str:
    return element_names.all_of([_target(element_names, flow) for flow in flows])


def _target(element_names: ElementNames, flow: str) -> str:
    known = element_names.mission.elements.get(flow)
    return known.target.id if isinstance(known, e.SequenceFlow) else flow
