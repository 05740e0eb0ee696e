"""The possible traces of a small model, as words: for tests of the reference itself."""

from itertools import pairwise

from tests.reference.diagram import Flow, Is, Level, Node
from tests.reference.interpreter import Input, Reference, awaited, open_tasks
from tests.reference.marking import Key, Marking


def drawn(*nodes: Node, flows: str) -> Level:
    """A level. `flows`: chains as `s>A>e`, with conditions as `X>B[A=b]`; ids are `A-B`."""
    found = []
    for word in flows.split():
        chain, _, condition = word.removesuffix("]").partition("[")
        names = chain.split(">")
        name, _, value = condition.partition("=")
        for source, target in pairwise(names):
            last = target == names[-1]
            is_true: str | bool = value == "true" if value in ("true", "false") else value
            when = Is(name, is_true) if condition and last else None
            found.append(Flow(f"{source}-{target}", source, target, when))
    return Level(nodes, tuple(found))


def traces(model: Level, *, inputs: int = 8, values: dict[str, str] | None = None) -> set[str]:
    """All traces of up to so many inputs, each `input input ... end`.

    An input is the name of a task (with each of its `values`, as `A=x`), or of a signal, `!s`; the
    end is the outcome, or `...` where the trace was cut.
    """
    reference = Reference(model)
    answers = {name: tuple(each) for name, each in (values or {}).items()}
    found = set()
    now: dict[tuple[str, Key], Marking] = {
        ("", marking.key()): marking for marking in reference.begin()
    }
    for number in range(inputs + 1):
        later: dict[tuple[str, Key], Marking] = {}
        for (trace, _), marking in now.items():
            if marking.outcome is not None:
                found.add(trace + marking.outcome)
                continue
            if number == inputs:
                found.add(trace + "...")
                continue
            for given in possible_inputs(marking, answers):
                word = f"!{given.name} " if given.kind == "signal" else f"{given.name} "
                if given.value is not None:
                    word = f"{given.name}={given.value} "
                for reaction in reference.choices(marking, given):
                    for after in reaction:
                        later[trace + word, after.key()] = after
        now = later
    return found


def possible_inputs(marking: Marking, answers: dict[str, tuple[str, ...]]) -> list[Input]:
    """What the outside can do: answer an open task in each way, or send an awaited signal."""
    found = [
        Input("answer", name, value)
        for name, _ in open_tasks(marking)
        for value in answers.get(name, (None,))
    ]
    return found + [Input("signal", name) for name in awaited(marking)]
