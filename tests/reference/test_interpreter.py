"""The reference interpreter, on models small enough to know their traces by heart."""

from dataclasses import replace

from tests.reference.diagram import Event, Level, Loop, Many, Node
from tests.reference.diagram import Is as Said
from tests.reference.traces import drawn, traces

S, E = Node("s", "start"), Node("e", "end")
A, B, C, D = (Node(name, "user") for name in "ABCD")
FORK, JOIN = Node("fork", "parallel"), Node("join", "parallel")
TERMINATE = Node("t", "end", Event("terminate"))
FAIL = Node("f", "end", Event("error", "E1"))


def caught(node: str, by: str, event: Event, *, interrupting: bool = True) -> Node:
    return Node(by, "boundary", event, attached_to=node, interrupting=interrupting)


def sub(name: str, *nodes: Node, flows: str) -> Node:
    return Node(name, "subprocess", inside=drawn(*nodes, flows=flows))


def test_a_sequence_has_one_trace() -> None:
    assert traces(drawn(S, A, B, E, flows="s>A>B>e")) == {"A B completed"}


def test_a_process_without_start_events_begins_where_no_flow_comes_in() -> None:
    assert traces(drawn(A, B, flows="")) == {"A B completed", "B A completed"}


def test_every_start_event_begins_and_a_typed_one_waits() -> None:
    typed = Node("s2", "start", Event("signal", "go"))
    model = drawn(S, typed, A, B, flows="s>A s2>B")
    assert traces(model) == {"A !go B completed", "!go A B completed", "!go B A completed"}


def test_several_flows_out_of_a_task_are_a_fork_and_several_into_one_are_a_merge() -> None:
    model = drawn(S, A, B, C, flows="s>A A>B A>C B>C")
    assert traces(model) == {"A B C C completed", "A C B C completed"}


def test_a_parallel_join_takes_one_token_from_each_flow() -> None:
    model = drawn(S, FORK, A, B, JOIN, C, flows="s>fork fork>A fork>B A>join B>join join>C")
    assert traces(model) == {"A B C completed", "B A C completed"}


def test_a_second_token_on_a_flow_is_no_other_branch_of_a_join() -> None:
    merge = Node("m", "exclusive")
    model = drawn(S, A, B, merge, JOIN, C, flows="s>A>m s>B>m m>join s>C>join")
    ends = {trace.split()[-1] for trace in traces(model)}
    assert ends == {"stuck"}
    assert "A B C stuck" in traces(model)


def test_an_exclusive_gateway_takes_the_first_true_flow() -> None:
    choice = Node("x", "exclusive", default="x-D")
    model = drawn(S, A, choice, B, C, D, flows="s>A>x x>B[A=a] x>C[A=a] x>D")
    assert traces(model, values={"A": "ab"}) == {"A=a B completed", "A=b D completed"}


def test_no_true_flow_and_no_default_is_an_error() -> None:
    choice = Node("x", "exclusive")
    model = drawn(S, A, choice, B, flows="s>A>x x>B[A=b]")
    assert traces(model, values={"A": "ab"}) == {"A=a failed", "A=b B completed"}


def test_conditions_and_a_default_flow_out_of_a_task() -> None:
    model = drawn(S, replace(A, default="A-C"), B, C, D, flows="s>A A>B[A=a] A>D[A=b] A>C")
    assert traces(model, values={"A": "abc"}) == {
        "A=a B completed",
        "A=b D completed",
        "A=c C completed",
    }


INCLUSIVE = (Node("o", "inclusive", default="o-D"), Node("oj", "inclusive"))
INCLUSIVE_FLOWS = "s>A>o o>B[A=a] o>C o>D B>oj C>oj D>oj oj>E"


def test_an_inclusive_join_waits_for_the_branches_that_were_taken() -> None:
    last = Node("E", "user")
    model = drawn(S, A, *INCLUSIVE, B, C, D, last, flows=INCLUSIVE_FLOWS)
    assert traces(model, values={"A": "ab"}) == {
        "A=a B C E completed",
        "A=a C B E completed",
        "A=b C E completed",
    }


def test_an_inclusive_join_waits_no_more_when_a_token_has_died() -> None:
    join = Node("oj", "inclusive")
    choice = Node("x", "exclusive", default="x-e")
    model = drawn(
        S, FORK, A, B, choice, join, E, C, flows="s>fork fork>A fork>B A>oj B>x x>oj[B=y] x>e oj>C"
    )
    found = traces(model, values={"B": "yn"})
    assert {"A B=n C completed", "B=n A C completed", "A B=y C completed"} <= found
    assert "A C B=n completed" not in found


def test_an_inclusive_join_does_not_wait_for_a_token_that_can_reach_a_taken_flow_too() -> None:
    """The second token is upstream of both flows into the join, one of which is taken."""
    join, choice = Node("oj", "inclusive"), Node("x", "exclusive", default="x-oj")
    first, second = Node("m", "exclusive"), Node("D", "user")
    model = drawn(
        S,
        FORK,
        A,
        B,
        first,
        choice,
        second,
        join,
        C,
        flows="s>fork fork>A fork>B A>m m>oj B>x x>oj x>m[B=m] s>D D>oj oj>C",
    )
    assert any(trace.startswith("A D C") for trace in traces(model, values={"B": "mn"}))
    assert not any(trace.startswith("A C") for trace in traces(model, values={"B": "mn"}))


def test_two_inclusive_joins_that_wait_for_each_other_are_stuck() -> None:
    left, right = Node("l", "inclusive"), Node("r", "inclusive")
    model = drawn(S, left, right, flows="s>l s>r l>r r>l")
    assert traces(model) == {"stuck"}


def test_a_terminate_end_event_ends_the_run() -> None:
    model = drawn(S, A, B, TERMINATE, flows="s>A>t s>B")
    assert traces(model) == {"A terminated", "B A terminated"}


def test_a_terminate_end_event_in_a_subprocess_ends_the_subprocess_alone() -> None:
    inner = sub("P", A, B, TERMINATE, flows="A>t")
    model = drawn(S, inner, C, flows="s>P>C")
    assert traces(model) == {"A C completed", "B A C completed"}


def test_a_subprocess_completes_when_no_token_is_left_in_it() -> None:
    model = drawn(S, sub("P", A, B, flows=""), C, flows="s>P>C")
    assert traces(model) == {"A B C completed", "B A C completed"}


def test_a_subprocess_whose_join_waits_for_ever_is_stuck() -> None:
    model = drawn(S, sub("P", A, B, JOIN, FORK, flows="A>join fork>B B>join"), flows="s>P")
    assert traces(model) == {"A B completed", "B A completed"}
    model = drawn(S, sub("P", A, JOIN, flows="A>join join>join"), flows="s>P")
    assert traces(model) == {"A stuck"}


def test_an_interrupting_boundary_event_ends_the_activity() -> None:
    model = drawn(S, A, caught("A", "b", Event("signal", "go")), B, C, flows="s>A>B b>C")
    assert traces(model) == {"A B completed", "!go C completed"}


def test_a_boundary_event_that_does_not_interrupt_may_happen_often() -> None:
    boundary = caught("A", "b", Event("signal", "go"), interrupting=False)
    model = drawn(S, A, boundary, flows="s>A")
    found = traces(model, inputs=3)
    assert found == {"A completed", "!go A completed", "!go !go A completed", "!go !go !go ..."}


def test_an_error_goes_outwards_to_the_boundary_event_that_names_it() -> None:
    inner = sub("Q", A, FAIL, B, flows="A>f")
    outer = sub("P", inner, caught("Q", "b1", Event("error", "E2")), flows="")
    model = drawn(S, outer, caught("P", "b", Event("error", "E1")), C, flows="s>P b>C")
    assert traces(model) == {"A C completed", "B A C completed"}
    assert traces(drawn(S, outer, flows="s>P")) == {"A failed", "B A failed"}


def test_an_escalation_that_nothing_catches_changes_nothing() -> None:
    throw = Node("x", "throw", Event("escalation", "X1"))
    inner = sub("P", throw, A, flows="x>A")
    model = drawn(S, inner, B, flows="s>P>B")
    assert traces(model) == {"A B completed"}
    boundary = caught("P", "b", Event("escalation"), interrupting=False)
    model = drawn(S, inner, boundary, B, flows="s>P b>B")
    assert traces(model) == {"A B completed", "B A completed"}
    assert traces(drawn(S, inner, replace(boundary, interrupting=True), B, flows="s>P b>B")) == {
        "B completed"
    }


def test_a_signal_reaches_every_catcher() -> None:
    c1, c2 = (Node(name, "catch", Event("signal", "go")) for name in ("c1", "c2"))
    model = drawn(S, c1, c2, A, B, flows="s>c1>A s>c2>B")
    assert traces(model) == {"!go A B completed", "!go B A completed"}


def test_a_signal_thrown_inside_interrupts_before_the_next_step() -> None:
    throw = Node("x", "throw", Event("signal", "go"))
    inner = sub("P", throw, A, B, flows="x>A")
    model = drawn(S, inner, caught("P", "b", Event("signal", "go")), C, flows="s>P>C b>C")
    assert traces(model) == {"C completed"}


def test_a_loop_back_runs_its_task_again() -> None:
    choice = Node("x", "exclusive", default="x-A")
    model = drawn(S, A, choice, E, flows="s>A>x x>e[A=n] x>A")
    assert traces(model, values={"A": "yn"}, inputs=2) == {
        "A=n completed",
        "A=y A=n completed",
        "A=y A=y ...",
    }


# --- event-based and complex gateways, links, quantities ----------------------------------------


def test_the_first_event_after_an_event_based_gateway_excludes_the_others() -> None:
    c1 = Node("c1", "catch", Event("signal", "one"))
    c2 = Node("c2", "catch", Event("signal", "two"))
    model = drawn(S, Node("g", "event_gateway"), c1, c2, A, B, flows="s>g g>c1>A g>c2>B")
    assert traces(model) == {"!one A completed", "!two B completed"}


COMPLEX = Node("k", "complex", needed=2)


def test_a_complex_gateway_is_activated_by_its_condition_and_reset_by_the_rest() -> None:
    model = drawn(S, A, B, C, COMPLEX, D, flows="s>A>k s>B>k s>C>k k>D[waitingForStart=true]")
    found = traces(model)
    assert {"A B D C completed", "A B C D completed", "C A B D completed"} <= found
    assert all(trace.count("D") == 1 for trace in found)


def test_a_complex_gateway_may_produce_tokens_at_its_reset() -> None:
    flows = "s>A>k s>B>k k>C[waitingForStart=true] k>D[waitingForStart=false]"
    model = drawn(S, A, B, replace(COMPLEX, needed=1), C, D, flows=flows)
    assert "A C B D completed" in traces(model)
    assert all("D" in trace for trace in traces(model))


def test_a_complex_gateway_that_has_used_all_its_flows_needs_no_reset() -> None:
    flows = "s>A>k s>B>k k>C[waitingForStart=true] k>D[waitingForStart=false]"
    assert traces(drawn(S, A, B, COMPLEX, C, D, flows=flows)) == {
        "A B C completed",
        "B A C completed",
    }


def test_a_complex_gateway_without_a_true_flow_is_an_error_at_the_start_alone() -> None:
    model = drawn(S, A, B, COMPLEX, C, flows="s>A>k s>B>k k>C[A=y]")
    assert traces(model, values={"A": "n"}) == {"A=n B failed", "B A=n failed"}


def test_a_complex_gateway_that_is_never_activated_is_stuck() -> None:
    model = drawn(S, A, replace(COMPLEX, needed=3), B, C, flows="s>A>k s>B>k k>C")
    assert traces(model) == {"A B stuck", "B A stuck"}


def test_a_link_goes_to_its_target() -> None:
    link = Event("link", "there")
    model = drawn(S, Node("l1", "throw", link), Node("l2", "catch", link), A, flows="s>l1 l2>A")
    assert traces(model) == {"A completed"}


def test_an_inclusive_join_waits_for_a_token_that_comes_by_a_link() -> None:
    link = Event("link", "there")
    join = Node("oj", "inclusive")
    model = drawn(
        S,
        A,
        B,
        Node("l1", "throw", link),
        Node("l2", "catch", link),
        join,
        C,
        flows="s>A>oj s>B>l1 l2>oj oj>C",
    )
    assert traces(model) == {"A B C completed", "B A C completed"}


def test_a_start_quantity_waits_for_its_tokens_from_any_flow() -> None:
    model = drawn(S, A, B, replace(C, start_quantity=2), flows="s>A>C s>B>C")
    assert traces(model) == {"A B C completed", "B A C completed"}
    model = drawn(S, A, replace(C, start_quantity=2), flows="s>A>C")
    assert traces(model) == {"A stuck"}


def test_a_completion_quantity_is_the_number_of_tokens_on_each_flow() -> None:
    model = drawn(S, replace(A, completion_quantity=2), B, flows="s>A>B")
    assert traces(model) == {"A B B completed"}


# --- loops and multi-instance -------------------------------------------------------------------


def test_a_standard_loop_goes_on_while_its_condition_is_true() -> None:
    again = Said("A", "y")
    after = drawn(S, replace(A, repeat=Loop(again, before=False, maximum=None)), B, flows="s>A>B")
    assert traces(after, values={"A": "yn"}, inputs=3) == {
        "A=n B completed",
        "A=y A=n B completed",
        "A=y A=y A=n ...",
        "A=y A=y A=y ...",
    }
    before = drawn(S, replace(A, repeat=Loop(again, before=True, maximum=None)), B, flows="s>A>B")
    assert traces(before, values={"A": "yn"}) == {"B completed"}
    capped = drawn(S, replace(A, repeat=Loop(again, before=False, maximum=2)), B, flows="s>A>B")
    assert traces(capped, values={"A": "y"}) == {"A=y A=y B completed"}


def test_instances_run_at_once_or_one_after_the_other() -> None:
    for sequential in (True, False):
        repeat = Many(2, sequential, None)
        model = drawn(S, replace(A, repeat=repeat), B, flows="s>A>B")
        assert traces(model) == {"A A B completed"}
    inner = replace(sub("P", A, B, flows="A>B"), repeat=Many(2, False, None))
    assert traces(drawn(S, inner, flows="s>P")) == {"A A B B completed", "A B A B completed"}
    inner = replace(inner, repeat=Many(2, True, None))
    assert traces(drawn(S, inner, flows="s>P")) == {"A B A B completed"}


def test_no_instances_complete_at_once() -> None:
    model = drawn(S, replace(A, repeat=Many(0, False, None)), B, flows="s>A>B")
    assert traces(model) == {"B completed"}


def test_the_completion_condition_ends_the_instances_that_are_left() -> None:
    for sequential in (True, False):
        inner = replace(sub("P", A, B, flows="A>B"), repeat=Many(3, sequential, 1))
        model = drawn(S, inner, C, flows="s>P>C")
        assert "A B C completed" in traces(model)
        assert all(trace.count("B") == 1 for trace in traces(model))


def test_an_instance_that_was_terminated_has_not_completed() -> None:
    inner = replace(sub("P", A, TERMINATE, flows="A>t"), repeat=Many(2, True, 1))
    assert traces(drawn(S, inner, flows="s>P")) == {"A A completed"}


def test_terminate_ends_one_instance_and_an_error_all() -> None:
    inner = replace(sub("P", A, B, TERMINATE, flows="A>t"), repeat=Many(2, False, None))
    assert "A A C completed" in traces(drawn(S, inner, C, flows="s>P>C"))
    inner = replace(sub("P", A, B, FAIL, flows="A>f"), repeat=Many(2, False, None))
    model = drawn(S, inner, caught("P", "b", Event("error")), C, flows="s>P b>C")
    assert traces(model) == {"A C completed", "B A C completed", "B B A C completed"}


# --- event subprocesses -------------------------------------------------------------------------


def handler(name: str, event: Event, *nodes: Node, flows: str, interrupting: bool) -> Node:
    start = Node(f"{name}s", "start", event, interrupting=interrupting)
    return Node(name, "event_subprocess", inside=drawn(start, *nodes, flows=flows))


def with_handler(*, interrupting: bool, event: Event, thrower: Node | None = None) -> Level:
    each = handler("H", event, C, flows="Hs>C", interrupting=interrupting)
    inner = Node(
        "P",
        "subprocess",
        inside=drawn(
            A, B, *([thrower] if thrower else []), each, flows=f"A>{thrower.id}" if thrower else ""
        ),
    )
    return drawn(S, inner, D, flows="s>P>D")


def test_an_interrupting_event_subprocess_takes_the_place_of_all_else_in_its_scope() -> None:
    model = with_handler(interrupting=True, event=Event("signal", "go"))
    assert "A !go C D completed" in traces(model)
    assert "!go C D completed" in traces(model)
    assert "A B D completed" in traces(model)
    assert not any(trace.count("!go") > 1 for trace in traces(model))


def test_an_event_subprocess_that_does_not_interrupt_runs_beside_and_often() -> None:
    model = with_handler(interrupting=False, event=Event("signal", "go"))
    found = traces(model, inputs=7)
    assert {"A !go B C D completed", "!go !go A C B C D completed"} <= found


def test_no_event_subprocess_begins_when_only_event_subprocesses_are_left() -> None:
    """13.5.4: the parent has completed its own work; it waits for its handlers, and starts none."""
    model = with_handler(interrupting=False, event=Event("signal", "go"))
    assert not any("A B !go" in trace for trace in traces(model))
    assert "A !go B !go C" not in " ".join(traces(model))


def test_an_event_subprocess_catches_errors_of_its_scope_and_of_scopes_inside() -> None:
    model = with_handler(interrupting=True, event=Event("error", "E1"), thrower=FAIL)
    assert traces(model) == {"A C D completed", "B A C D completed"}


def test_an_error_in_an_error_handler_goes_further_out() -> None:
    each = handler("H", Event("error"), C, FAIL, flows="Hs>C>f", interrupting=True)
    inner = Node("P", "subprocess", inside=drawn(A, replace(FAIL, id="f1"), each, flows="A>f1"))
    model = drawn(S, inner, caught("P", "b", Event("error")), D, flows="s>P b>D")
    assert traces(model) == {"A C D completed"}
    assert traces(drawn(S, inner, flows="s>P")) == {"A C failed"}


def test_an_escalation_is_caught_by_an_event_subprocess_before_a_boundary_event() -> None:
    throw = Node("x", "throw", Event("escalation", "X1"))
    model = with_handler(interrupting=False, event=Event("escalation", "X1"), thrower=throw)
    assert {"A B C D completed", "A C B D completed", "B A C D completed"} == traces(model)
