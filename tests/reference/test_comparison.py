"""The engine has the same possible traces as the reference, on random models.

`tests.reference.comparison` says what is compared. Runs with loops and models with many orders are
cut at its `Bounds`; what was cut is counted, and most must not be.
"""

from collections.abc import Callable
from random import Random

import pytest

from m2pem.errors import MissionError
from tests.reference import comparison
from tests.reference.catching import TooLargeError
from tests.reference.comparison import Bounds, Counts, DifferenceError, compare
from tests.reference.diagram import Event, Flow, Level, Node, all_nodes, levels
from tests.reference.drafting import ELEMENTS
from tests.reference.engine_side import Engine
from tests.reference.random_blocks import random_blocks
from tests.reference.random_graphs import random_graph
from tests.reference.shrinking import shrunk
from tests.reference.traces import drawn
from tests.reference.xml_of import xml_of

FEW = 80
MANY = 2_000
QUICK = Bounds()
THOROUGH = Bounds(inputs=7, nodes=60, states=10, orders=500, budget=10_000)
BOTH = pytest.mark.parametrize("generate", [random_blocks, random_graph])

Generate = Callable[[Random], Level]


def compare_all(generate: Generate, seeds: range, bounds: Bounds) -> Counts:
    """Compare many models; the first difference is shown on a model as small as can be."""
    total, compared = Counts(), 0
    for seed in seeds:
        model = generate(Random(seed))
        try:
            counts = compare(model, bounds)
        except TooLargeError:
            continue
        except DifferenceError:
            smallest = shrunk(model, lambda each: differs(each, bounds))
            with pytest.raises(DifferenceError) as caught:
                compare(smallest, bounds)
            pytest.fail(f"seed {seed} of {generate.__name__}\n{caught.value}", pytrace=False)
        except Exception as error:
            error.add_note(f"seed {seed} of {generate.__name__}\n{xml_of(model)}")
            raise
        compared += 1
        total.reactions += counts.reactions
        total.equal += counts.equal
        total.cut += counts.cut
    assert compared > 0.9 * len(seeds)
    assert total.reactions > 8 * compared
    assert total.equal > 0.8 * total.reactions
    assert total.cut < 0.5 * compared
    return total


def differs(model: Level, bounds: Bounds) -> bool:
    for level in levels(model):
        if any(not level.incoming[n.id] for n in level.nodes if n.kind.endswith("clusive")):
            return False
    try:
        compare(model, bounds)
    except DifferenceError:
        return True
    except (MissionError, TooLargeError, LookupError, StopIteration):
        return False
    return False


@BOTH
def test_the_engine_has_the_traces_of_the_reference(generate: Generate) -> None:
    compare_all(generate, range(FEW), QUICK)


@pytest.mark.long
@pytest.mark.timeout(7200)
@BOTH
def test_the_engine_has_the_traces_of_the_reference_on_many_models(generate: Generate) -> None:
    compare_all(generate, range(FEW, MANY), THOROUGH)


@BOTH
def test_random_models_have_all_kinds_of_elements(generate: Generate) -> None:
    nodes = [node for seed in range(250) for node in all_nodes(generate(Random(seed)))]
    kinds = {"user", "subprocess", "boundary", "start", "end", "throw", "catch"}
    kinds |= ELEMENTS & {"exclusive", "parallel", "inclusive", "complex", "event_gateway", "task"}
    kinds |= ELEMENTS & {"event_subprocess"}
    assert kinds <= {node.kind for node in nodes}
    thrown = {n.event.kind for n in nodes if n.event is not None}
    assert {"signal", "error", "escalation", "terminate"} <= thrown


# --- that a difference is seen --------------------------------------------------------------------

A, B = Node("A", "user"), Node("B", "user")
START = Node("s", "start")


def played_as(monkeypatch: pytest.MonkeyPatch, other: Level) -> None:
    """Let the engine play another model than the reference."""
    monkeypatch.setattr(comparison, "Engine", lambda model: Engine(other))


def test_what_the_engine_does_and_the_reference_cannot_is_a_difference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = drawn(START, A, B, flows="s>A>B")
    played_as(monkeypatch, drawn(START, A, B, flows="s>A"))
    with pytest.raises(DifferenceError, match="after A answered done") as caught:
        compare(model, QUICK)
    assert '<sequenceFlow id="A-B"' in str(caught.value)


def test_what_the_engine_must_do_and_does_not_is_a_difference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The signal reaches the task's boundary event, or nothing: one trace is not enough."""
    boundary = Node("b", "boundary", Event("signal", "go"), attached_to="A")
    played_as(monkeypatch, drawn(START, A, flows="s>A"))
    with pytest.raises(DifferenceError, match="after the start"):
        compare(drawn(START, A, boundary, flows="s>A"), QUICK)


def test_an_order_that_can_be_seen_may_be_either(monkeypatch: pytest.MonkeyPatch) -> None:
    """One branch ends the run while the other goes on: how far that comes is open."""
    end = Node("t", "end", Event("terminate"))
    flows = (Flow("f1", "s", "t"), Flow("f2", "s", "n"), Flow("f3", "n", "m"))
    nodes = (START, end, Node("n", "task"), Node("m", "task"))
    for first in (flows, flows[::-1]):
        played_as(monkeypatch, Level(nodes, first))
        counts = compare(Level(nodes, flows), QUICK)
        assert (counts.reactions, counts.equal) == (1, 0)
