"""Builds the state graph of a model's Petri net with SNAKES: JSON in, JSON out.

Run by its own interpreter, which has SNAKES and not m2pem. It is a library of nets: the net of
start and end events, tasks, and parallel and exclusive gateways is made here, a place for each
flow. The end can be reached from each state, or it is violated.
"""

import json
import sys
import time
from collections import defaultdict
from typing import Any
from xml.etree import ElementTree

from snakes.nets import PetriNet, Place, StateGraph, Transition, Value, dot

BPMN = "{http://www.omg.org/spec/BPMN/20100524/MODEL}"


def net_of(xml: str) -> tuple[Any, set[str]]:
    """The net of a model's only process, and the places of its ends."""
    process = ElementTree.fromstring(xml).find(f"{BPMN}process")
    assert process is not None
    comes, goes = defaultdict(list), defaultdict(list)
    net, ends = PetriNet("model"), set()
    for flow in process.iter(f"{BPMN}sequenceFlow"):
        net.add_place(Place(flow.attrib["id"], []))
        goes[flow.attrib["sourceRef"]].append(flow.attrib["id"])
        comes[flow.attrib["targetRef"]].append(flow.attrib["id"])
    for node in process:
        kind, name = node.tag.removeprefix(BPMN), node.attrib.get("id", "")
        if kind == "startEvent":
            net.add_place(Place(name, [dot]))
            step(net, f"do {name}", [name], goes[name])
        elif kind == "endEvent":
            net.add_place(Place(name, []))
            ends.add(name)
            step(net, f"do {name}", comes[name], [name])
        elif kind == "exclusiveGateway":
            for one in comes[name]:
                for other in goes[name]:
                    step(net, f"do {name} {one} {other}", [one], [other])
        elif kind == "parallelGateway" or kind.lower().endswith("task"):
            step(net, f"do {name}", comes[name], goes[name])
        elif kind != "sequenceFlow":
            raise ValueError(f"{kind} is not translated")
    return net, ends


def step(net: Any, name: str, takes: list[str], puts: list[str]) -> None:
    """A transition."""
    net.add_transition(Transition(name))
    for place in takes:
        net.add_input(place, name, Value(dot))
    for place in puts:
        net.add_output(place, name, Value(dot))


def sound(graph: Any, ends: set[str]) -> bool:
    """Whether from each state one can be reached in which all tokens are at ends."""
    before, goals = defaultdict(list), []
    for state in graph:
        marking = graph[state]
        if {place for place, tokens in marking.items() if tokens} <= ends:
            goals.append(state)
        for after, _, _ in graph.successors(state):
            before[after].append(state)
    reached = set(goals)
    while goals:
        for state in before[goals.pop()]:
            if state not in reached:
                reached.add(state)
                goals.append(state)
    return len(reached) == len(graph)


def main() -> None:
    """Read, translate, search, and answer."""
    order = json.load(sys.stdin)
    began = time.process_time(), time.perf_counter()
    net, ends = net_of(order["xml"])
    read_s = time.process_time() - began[0]
    graph = StateGraph(net)
    graph.build()
    verdict = "holds" if sound(graph, ends) else "violated"
    cpu_s, wall_s = time.process_time() - began[0], time.perf_counter() - began[1]
    figures = {"search_s": cpu_s - read_s, "all_s": cpu_s, "wall_s": wall_s}
    print(json.dumps({**figures, "states": len(graph), "verdict": verdict}))


if __name__ == "__main__":
    main()
