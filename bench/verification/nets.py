"""Workflow nets (PNML) as BPMN files.

The nets are free-choice: a place with several consumers is the only input of each of them. So a
place is an exclusive gateway, a transition is a parallel gateway, and a place at which a task works
is a user task. What has one way in and one way out is a sequence flow.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

from bench.graphs import file
from bench.verification.models import TASK

WORKS = ".used"
"""How the name of a place ends at which a task works, in the IBM collection."""


class UnfitError(Exception):
    """A net has no BPMN file that does the same."""


@dataclass(slots=True)
class _Net:
    places: list[str] = field(default_factory=list)
    transitions: list[str] = field(default_factory=list)
    marked: list[str] = field(default_factory=list)
    before: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    after: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))


def bpmn_of(pnml: bytes) -> str:
    """Return the BPMN file that does what a net does.

    Raises:
        UnfitError: the net is not free-choice, does not begin with one token, or has transitions
            or unmarked places without an input, or transitions without an output.
    """
    net = _read(pnml)
    _refuse_unfit(net)
    kinds = dict.fromkeys(net.transitions, "parallelGateway")
    for place in net.places:
        kinds[place] = "userTask" if place.endswith(WORKS) else "exclusiveGateway"
        if not net.after[place]:
            kinds[place] = "endEvent"
        if place in net.marked:
            kinds[place] = "startEvent"
    for place in net.places:
        if kinds[place] in ("startEvent", "userTask"):
            _choose_behind(net, place, kinds)
    passed = {
        each
        for each, kind in kinds.items()
        if kind.endswith("Gateway") and len(net.before[each]) == len(net.after[each]) == 1
    }
    return _written(net, kinds, passed)


def _read(pnml: bytes) -> _Net:
    net = _Net()
    for each in ET.fromstring(pnml).iter():
        name = each.get("id", "")
        if each.tag == "place":
            net.places.append(name)
            marked = each.find("initialMarking/text")
            if marked is not None:
                net.marked += [name] * int(marked.text or "0")
        elif each.tag == "transition":
            net.transitions.append(name)
        elif each.tag == "arc":
            source, target = each.attrib["source"], each.attrib["target"]
            net.after[source].append(target)
            net.before[target].append(source)
    return net


def _refuse_unfit(net: _Net) -> None:
    if len(net.marked) != 1 or net.before[net.marked[0]]:
        raise UnfitError("it does not begin with one token on a place without an input")
    for each in net.transitions:
        if not net.before[each] or not net.after[each]:
            raise UnfitError(f"transition {each} has no input or no output")
    for each in net.places:
        if not net.before[each] and each not in net.marked:
            raise UnfitError(f"place {each} never has a token")
        if len(net.after[each]) > 1 and any(net.before[t] != [each] for t in net.after[each]):
            raise UnfitError(f"place {each} is no free choice")


def _choose_behind(net: _Net, place: str, kinds: dict[str, str]) -> None:
    """Put a gateway behind a task or start event with several ways out: each would get a token."""
    if len(net.after[place]) < 2:
        return
    choice = f"{place}.choice"
    kinds[choice] = "exclusiveGateway"
    for target in net.after[place]:
        net.before[target] = [choice if each == place else each for each in net.before[target]]
    net.after[choice], net.before[choice] = net.after[place], [place]
    net.after[place] = [choice]


def _behind(net: _Net, name: str, passed: set[str]) -> str:
    """What comes after nodes that are only passed."""
    while name in passed:
        name = net.after[name][0]
    return name


def _written(net: _Net, kinds: dict[str, str], passed: set[str]) -> str:
    numbers = {name: f"n{number}" for number, name in enumerate(kinds)}
    flows: list[tuple[str, str]] = []
    for source in kinds.keys() - passed:
        for target in net.after[source]:
            flows.append((numbers[source], numbers[_behind(net, target, passed)]))
    flows.sort()
    ends: dict[str, str] = defaultdict(str)
    for number, (source, target) in enumerate(flows):
        ends[target] = f"<incoming>f{number}</incoming>{ends[target]}"
        ends[source] += f"<outgoing>f{number}</outgoing>"
    text = ""
    for name, kind in kinds.items():
        if name not in passed:
            inside = (TASK if kind == "userTask" else "") + ends[numbers[name]]
            text += f'<{kind} id="{numbers[name]}" name={quoteattr(name)}>{inside}</{kind}>'
    for number, (source, target) in enumerate(flows):
        text += f'<sequenceFlow id="f{number}" sourceRef="{source}" targetRef="{target}"/>'
    return file(f'<process id="NET" isExecutable="true">{text}</process>').decode()
