"""A run of the net as numbered steps, in the words of the diagram."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.mission import elements as e
from m2pem.mission.behavior import Behavior
from m2pem.mission.events import RootElement
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import (
    BEGINS,
    UNDOES,
    UNDONE,
    Action,
    Kind,
    Rule,
    Step,
    System,
    Trigger,
)


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


COMMANDS = "commands"
"""Detail of the step in which a task's behavior is asked for, after the task was entered."""
_NUMBERED = re.compile(r"(#\d+|\[\d+\])$")
_SAME = -1
"""Index of what belongs to the rule before it."""
_PASSED = (Action.TAKEN,)


@dataclass(frozen=True, slots=True)
class Token:
    """Tokens on an element. `flow`: they have come to it by that flow, and wait; "" otherwise."""

    element: str
    count: int
    flow: str = ""


@dataclass(frozen=True, slots=True)
class Told:
    """A step of a story, numbered from 1.

    `passes`: elements and flows that it passes; its number stands at the first. `element`: whose
    step it is. `rules`: those that it is made of. `trigger`: what came from outside, "" for
    nothing. `actions`: what happens to elements. `tokens`: where they are after it.
    `data`: what names have then, with the calls that they are in before them; `writes`: what came
    with the trigger, under the names that the mission knows.
    """

    number: int
    text: str
    element: str
    passes: tuple[str, ...]
    rules: tuple[int, ...]
    trigger: str
    detail: str
    actions: tuple[Step, ...]
    tokens: tuple[Token, ...]
    data: Mapping[str, Value]
    writes: Mapping[str, Value]


def tell(
    system: System, words: Words, run: Sequence[int], *, begin: int = 0, at: int | None = None
) -> tuple[tuple[Told, ...], int]:
    """The story of a run, and the state in which it ends.

    `begin`: how many steps were told before; `at`: the state that those led to, None for the first.
    """
    encoding = encoding_of(system)
    state = encoding.initial if at is None else at
    told: list[Told] = []
    waiting: list[Rule] = []
    rules = [part for index in run for part in _parts(system.rules[index])]
    commanded = _commanded_later(rules)
    for number, rule in enumerate(rules):
        if rule.index != _SAME:
            state, _ = encoding.fire(rule.index, state)
        if number in commanded.values():
            continue
        if number in commanded:
            waiting.append(rules[commanded[number]])
        waiting.append(rule)
        if number + 1 < len(rules) and _same_step(rule, rules[number + 1]):
            continue
        if any(each.steps for each in waiting):
            told.append(_told(begin + len(told) + 1, waiting, words, encoding, state))
            waiting = []
    return tuple(told), state


def _parts(rule: Rule) -> list[Rule]:
    """What of a rule are steps of their own: one that several were made one of has several."""
    groups: list[list[Step]] = []
    for step in rule.steps:
        moved_on = groups and groups[-1][-1].action is Action.TAKEN
        again = step.action in (Action.COMPLETED, Action.ENTERED)
        if not groups or (moved_on and again) or _beside(groups[-1][-1], step):
            groups.append([])
        groups[-1].append(step)
    if len(groups) < 2:
        return [rule]
    first = replace(rule, steps=tuple(groups[0]))
    later = [
        replace(rule, index=_SAME, steps=tuple(group), kind=Kind.INTERNAL, trigger=None, assign=())
        for group in groups[1:]
    ]
    return [first, *later]


def _beside(one: Step, other: Step) -> bool:
    """Whether another element is entered: a fork's branches begin each for itself."""
    return one.action is other.action is Action.ENTERED and one.element != other.element


def _commanded_later(rules: Sequence[Rule]) -> dict[int, int]:
    """By place in the run where a task commands its vehicles, or begins its work, the place where
    it was entered.

    To people that is one step, also when others are in between.
    """
    entered: dict[str, int] = {}
    found: dict[int, int] = {}
    for number, rule in enumerate(rules):
        if not rule.steps:
            continue
        first = rule.steps[0]
        if len(rule.steps) == 1 and first.detail in (COMMANDS, BEGINS):
            if first.element in entered:
                found[number] = entered.pop(first.element)
        elif len(rule.steps) == 1 and first.action is Action.ENTERED and rule.trigger is None:
            entered[first.element] = number
        else:
            for step in rule.steps:
                entered.pop(step.element, None)
    return found


def encoding_of(system: System) -> Encoding:
    """One with room for several tokens everywhere, so that each run can be followed."""
    return Encoding(system, {place.index: 3 for place in system.places})


def tokens_of(encoding: Encoding, state: int) -> tuple[Token, ...]:
    """Where tokens of the mission are: those that only the rules need are left out."""
    found: dict[tuple[str, str], int] = {}
    for index, count in encoding.marking(state).tokens.items():
        place = encoding.system.places[index]
        if place.role in ("control", "end"):
            continue
        known = place.element
        key = (known, known) if place.role == "flow" else (known, "")
        found[key] = found.get(key, 0) + count
    return tuple(Token(element, count, flow) for (element, flow), count in found.items())


def data_of(encoding: Encoding, state: int) -> dict[str, Value]:
    """What the names have that the rules know of."""
    values = encoding.marking(state).values
    return {
        variable.name: variable.values[values[variable.index]]
        for variable in encoding.system.variables
        if variable.index in values
    }


def _same_step(rule: Rule, following: Rule) -> bool:
    """Whether two rules are one step to people: an event is triggered, and goes on."""
    if not rule.steps or not following.steps:
        return not rule.steps
    second = following.steps[0]
    before = {step.action for step in rule.steps if step.element == second.element}
    again = second.action is Action.COMPLETED and Action.TRIGGERED in before
    return again and following.trigger is None


def _told(number: int, rules: Sequence[Rule], words: Words, encoding: Encoding, state: int) -> Told:
    rule = next((each for each in rules if each.trigger is not None), rules[-1])
    actions = tuple(dict.fromkeys(step for each in rules for step in each.steps))
    element = next(each for each in rules if each.steps).element
    taken = [step.element for step in actions if step.action in _PASSED]
    others = [step.element for step in actions if step.action not in _PASSED]
    writes = _writes(rule, words, encoding.system)
    return Told(
        number,
        _sentence(rule, actions, words, writes),
        element,
        tuple(dict.fromkeys([*taken, *others])),
        tuple(each.index for each in rules if each.index != _SAME),
        rule.trigger.value if rule.trigger is not None else "",
        rule.detail,
        actions,
        tokens_of(encoding, state),
        data_of(encoding, state),
        writes,
    )


def _writes(rule: Rule, words: Words, system: System) -> dict[str, Value]:
    """What came with a trigger."""
    if rule.trigger is None:
        return {}
    return {
        _local(words, system.variables[variable].name): system.variables[variable].values[value]
        for variable, value in rule.assign
    }


def _local(words: Words, name: str) -> str:
    """A variable's name without the calls and processes that it is in."""
    parts = name.split(".")
    while len(parts) > 1 and _NUMBERED.sub("", parts[0]) in words.mission.elements:
        parts = parts[1:]
    return ".".join(parts)


# --- sentences ------------------------------------------------------------------------------------


def _sentence(
    rule: Rule, actions: Sequence[Step], words: Words, writes: Mapping[str, Value]
) -> str:
    element = actions[0].element
    name = words.with_id(element)
    failed = rule.trigger is Trigger.FAILS
    if rule.trigger is not None:
        said = _from_outside(rule, name, words)
        if rule.trigger is not Trigger.ANSWER and writes:
            values = " and ".join(f"{key} = {value!r}" for key, value in writes.items())
            said += f", with {values}"
    else:
        said = _internal(actions[0], actions, words)
    parts = [said, *_besides(element, actions, words, failed=failed)]
    return "; ".join(part for part in parts if part)


def _from_outside(rule: Rule, name: str, words: Words) -> str:
    match rule.trigger:
        case Trigger.SUCCEEDS:
            return f"{name} succeeds"
        case Trigger.FAILS:
            return f"{name} fails with {rule.detail or 'an error'}"
        case Trigger.ANSWER:
            return f"{name}: the operator answers '{rule.detail}'"
        case Trigger.TIMER:
            return f"{name}: the time is up"
        case Trigger.SIGNAL | Trigger.MESSAGE:
            return f"{name}: {words.thrown(rule.detail)} comes"
        case Trigger.CONDITION:
            return f"{name}: its condition becomes true"
        case _:
            return f"{name}: {rule.detail}" if rule.detail else name


def _internal(first: Step, actions: Sequence[Step], words: Words) -> str:
    node = words.mission.elements.get(first.element)
    name = words.with_id(first.element)
    taken = [step.element for step in actions if step.action is Action.TAKEN]
    if isinstance(node, e.Gateway) and taken:
        named = [flow for flow in taken if _named(words, flow)]
        if len(taken) == 1 and named:
            return f"{name}: {words.name(taken[0])}"
        return f"{name}: on to {words.all_of([_target(words, flow) for flow in taken])}"
    match first.action:
        case Action.ENTERED if isinstance(node, e.UserTask):
            return f"{name} asks the operator"
        case Action.ENTERED:
            commands = words.behavior(first.element)
            commanded = any(step.detail == COMMANDS for step in actions)
            return f"{name}: {commands}" if commands and commanded else f"{name} begins"
        case Action.INTERRUPTED:
            return ""
        case Action.THROWN:
            return ""
        case Action.TRIGGERED:
            return f"{name} {first.detail if first.detail in (UNDOES, UNDONE) else 'is triggered'}"
        case Action.COMPLETED if isinstance(node, e.EndEvent):
            return f"{name} is reached"
        case Action.COMPLETED if isinstance(node, e.StartEvent):
            return f"{name}: on to {words.all_of([_target(words, flow) for flow in taken])}"
        case Action.COMPLETED if isinstance(node, e.IntermediateThrowEvent) and len(actions) > 1:
            return ""
        case Action.COMPLETED:
            return f"{name} is over"
        case _:
            return f"{name} \u2192"


def _besides(
    element: str, actions: Sequence[Step], words: Words, *, failed: bool = False
) -> list[str]:
    """What else the step does: it throws, interrupts, triggers."""
    said = []
    for place, step in enumerate(actions):
        name = words.name(step.element)
        if step.action is Action.THROWN:
            if failed and step.element == element:
                continue
            what = words.thrown(step.detail) if step.detail else "its error"
            said.append(f"{name} throws {what}")
        elif step.action is Action.INTERRUPTED:
            said.append(f"{name} is interrupted")
        elif step.action is Action.TRIGGERED and place and step.element != element:
            said.append(f"{words.with_id(step.element)} is triggered")
        elif step.action is Action.COMPLETED and place and step.element != element:
            said.append(f"{name} is over")
    return list(dict.fromkeys(said))


def _named(words: Words, flow: str) -> bool:
    known = words.mission.elements.get(flow)
    return known is not None and bool(known.name)


def _target(words: Words, flow: str) -> str:
    known = words.mission.elements.get(flow)
    return known.target.id if isinstance(known, e.SequenceFlow) else flow
