"""Whether an observer accepts a run that cycles for ever, by trying all of its paths."""

from collections.abc import Sequence

from m2pem.verify.ltl import Observer
from m2pem.verify.ltl.automaton import components
from m2pem.verify.ltl.lasso import Moment


def accepts(observer: Observer, prefix: Sequence[Moment], cycle: Sequence[Moment]) -> bool:
    def letter(moment: Moment) -> int:
        return sum(1 << n for n, each in enumerate(observer.propositions) if each in moment)

    letters = [letter(moment) for moment in (*prefix, *cycle)]
    first = (0, observer.start)
    numbers = {first: 0}
    nodes = [first]
    edges: list[list[tuple[int, int]]] = []
    while len(edges) < len(nodes):
        at, state = nodes[len(edges)]
        then = at + 1 if at + 1 < len(letters) else len(prefix)
        found = []
        for target, postponed in observer.step(state, letters[at]):
            node = (then, target)
            if node not in numbers:
                numbers[node] = len(nodes)
                nodes.append(node)
            found.append((numbers[node], postponed))
        edges.append(found)
    component = components([[target for target, _ in each] for each in edges])
    together: dict[int, int] = {}
    for node, each in enumerate(edges):
        for target, postponed in each:
            if component[node] == component[target]:
                number = component[node]
                together[number] = together.get(number, observer.promises) & postponed
    return any(always_postponed == 0 for always_postponed in together.values())
