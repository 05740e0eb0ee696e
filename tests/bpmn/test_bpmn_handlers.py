"""Event subprocesses, conditional events and links: what reading makes of them, or refuses."""

import pytest
from bpmn_text import around, findings, flow, line_of, load, process, summary

from m2pem.bpmn.lint import lint
from m2pem.mission.elements import Event, IntermediateCatchEvent, SubProcess
from m2pem.mission.events import ConditionalEventDefinition
from m2pem.mission.mission import Mission

TASK = '<task id="T"/>'
SIGNAL = '<signal id="go"/>'


def handler(start: str, identifier: str = "H", more: str = "") -> str:
    """An event subprocess with one start event, `hs`, on one line."""
    return (
        f'<subProcess id="{identifier}" triggeredByEvent="true">{start}<task id="ht"/>'
        f'{flow("hs", "ht")}<endEvent id="he"/>{flow("ht", "he")}{more}</subProcess>'
    )


def with_handler(start: str, more: str = "") -> bytes:
    """A process with a handler on line 3."""
    return process(f"{handler(start, more=more)}\n{TASK}{line_of('T')}", SIGNAL)


def on_signal(attributes: str = "") -> str:
    return f'<startEvent id="hs" {attributes}><signalEventDefinition signalRef="go"/></startEvent>'


def sub(mission: Mission, identifier: str) -> SubProcess:
    found = mission.elements[identifier]
    assert isinstance(found, SubProcess)
    return found


# --- event subprocesses -------------------------------------------------------------------------


def test_an_event_subprocess_belongs_to_its_container_and_is_no_entry_of_it() -> None:
    mission = load(with_handler(on_signal()))
    [main] = mission.processes
    assert [each.id for each in main.event_subprocesses] == ["H"]
    assert [each.id for each in main.entries] == ["S"]
    assert sub(mission, "H").triggered_by_event
    assert not mission.warnings


def test_a_compensation_handler_is_no_entry_of_a_container_without_start_events() -> None:
    mission = load(
        process(
            f'<subProcess id="X">{handler(on_signal())}{TASK}</subProcess>{line_of("X")}', SIGNAL
        )
    )
    assert [each.id for each in sub(mission, "X").entries] == ["T"]
    assert [each.id for each in sub(mission, "X").event_subprocesses] == ["H"]


def test_its_start_event_interrupts_unless_it_says_otherwise() -> None:
    for attributes, interrupting in (
        ("", True),
        ('isInterrupting="true"', True),
        ('isInterrupting="false"', False),
    ):
        [start] = sub(load(with_handler(on_signal(attributes))), "H").starts
        assert start.interrupting is interrupting


def test_event_subprocesses_nest() -> None:
    inner = handler(on_signal(), "I").replace("hs", "is").replace("ht", "it").replace("he", "ie")
    mission = load(with_handler(on_signal(), more=inner))
    assert sub(mission, "H").event_subprocesses == (mission.elements["I"],)


REFUSED = {
    "start without a trigger": (with_handler('<startEvent id="hs"/>'), [("no-trigger", 3, "hs")]),
    "no start event": (
        process(
            '<subProcess id="H" triggeredByEvent="true"><task id="ht"/></subProcess>\n'
            f"{TASK}{line_of('T')}"
        ),
        [("no-start", 3, "H")],
    ),
    "an error that does not interrupt": (
        with_handler(
            '<startEvent id="hs" isInterrupting="false"><errorEventDefinition/></startEvent>'
        ),
        [("error-not-interrupting", 3, "hs")],
    ),
    "a trigger that starts nothing": (
        with_handler('<startEvent id="hs"><terminateEventDefinition/></startEvent>'),
        [("event-subprocess-start-trigger", 3, "hs")],
    ),
    "an ad-hoc event subprocess": (
        process(
            '<adHocSubProcess id="H" triggeredByEvent="true"><task id="ht"/></adHocSubProcess>\n'
            f"{TASK}{line_of('T')}"
        ),
        [("bad-value", 3, "H"), ("unreachable", 3, "H")],
    ),
    "several tokens": (
        process(
            handler(on_signal()).replace("<subProcess", '<subProcess startQuantity="2"')
            + f"\n{TASK}{line_of('T')}",
            SIGNAL,
        ),
        [("start-quantity", 3, "H")],
    ),
    "nothing but an event subprocess": (
        around(
            f'<subProcess id="T">{handler(on_signal())}</subProcess>',
            SIGNAL,
        ),
        [("no-start", 3, "T")],
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_handlers_that_bpmn_forbids_are_refused(case: str) -> None:
    data, expected = REFUSED[case]
    assert summary(data) == expected


# --- conditional events -------------------------------------------------------------------------


def conditional(condition: str, attributes: str = "") -> str:
    """A catch event T that waits for a condition, on line 3."""
    return (
        '<intermediateCatchEvent id="T"><conditionalEventDefinition>'
        f"<condition{attributes}>{condition}</condition>"
        "</conditionalEventDefinition></intermediateCatchEvent>"
    )


@pytest.mark.parametrize(
    ("condition", "attributes"),
    [
        ("x > 3", ""),
        ("${x > 3}", ' xsi:type="tFormalExpression" language="juel"'),
        ("= x > 3", ""),
        ("x > 3", ' language="FEEL"'),
    ],
)
def test_a_condition_may_be_in_any_dialect(condition: str, attributes: str) -> None:
    event = load(around(conditional(condition, attributes))).elements["T"]
    assert isinstance(event, Event)
    [definition] = event.definitions
    assert isinstance(definition, ConditionalEventDefinition)
    assert definition.condition.holds({"x": 4}.get)
    assert not definition.condition.holds({"x": 3}.get)


def test_what_filters_a_condition_elsewhere_is_a_warning() -> None:
    text = conditional("x > 3").replace(
        "<conditionalEventDefinition>",
        '<conditionalEventDefinition camunda:variableName="x" camunda:variableEvents="create">',
    )
    assert summary(around(text)) == [("foreign-effect", 3, "T")]


def test_a_condition_may_stand_in_an_event_definition_of_the_file() -> None:
    data = around(
        '<intermediateCatchEvent id="T"><eventDefinitionRef>low</eventDefinitionRef>'
        "</intermediateCatchEvent>",
        '<conditionalEventDefinition id="low"><condition>x</condition>'
        "</conditionalEventDefinition>",
    )
    event = load(data).elements["T"]
    assert isinstance(event, Event)
    assert isinstance(event.definitions[0], ConditionalEventDefinition)


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (conditional(""), "no-condition"),
        (conditional("x >"), "bad-expression"),
        (conditional("x > 3").replace("<condition>x > 3</condition>", ""), "no-condition"),
    ],
)
def test_a_conditional_event_without_a_proper_condition_is_refused(text: str, rule: str) -> None:
    assert summary(around(text)) == [(rule, 3, "T")]


# --- links --------------------------------------------------------------------------------------


def throw(name: str, identifier: str = "L1") -> str:
    return (
        f'<intermediateThrowEvent id="{identifier}"><linkEventDefinition name="{name}"/>'
        "</intermediateThrowEvent>"
    )


def catch(name: str, identifier: str = "L2") -> str:
    return (
        f'<intermediateCatchEvent id="{identifier}"><linkEventDefinition name="{name}"/>'
        "</intermediateCatchEvent>"
    )


def linked(*lines: str, more: str = "") -> bytes:
    """S -> L1 and L2 -> E, with the lines of text from line 3 on."""
    ends = '<startEvent id="S"/><endEvent id="E"/>'
    flows = flow("S", "L1") + flow("L2", "E")
    return process("\n".join([*lines, ends + flows + more]))


def test_links_join_sources_and_target_of_a_name_both_ways() -> None:
    mission = load(linked(throw("a"), throw("a", "L3"), catch("a"), more=flow("S", "L3")))
    target = mission.elements["L2"]
    sources = (mission.elements["L1"], mission.elements["L3"])
    assert isinstance(target, IntermediateCatchEvent)
    assert target.linked_from == sources
    assert all(each.links_to is target for each in sources)  # type: ignore[attr-defined]
    assert not lint(mission)


def test_a_link_without_a_name_has_that_of_its_event() -> None:
    named = linked(
        throw("").replace('id="L1"', 'id="L1" name="a"').replace(' name=""', "", 1), catch("a")
    )
    assert load(named).elements["L1"].links_to is not None  # type: ignore[attr-defined]


def test_links_of_one_name_in_two_containers_are_apart() -> None:
    ends = throw("a", "L3") + catch("a", "L4")
    inner = f'<subProcess id="X">{ends}{TASK}{flow("L4", "T")}</subProcess>'
    mission = load(linked(throw("a"), catch("a"), inner, more=flow("S", "X") + flow("X", "E")))
    for source, target in (("L1", "L2"), ("L3", "L4")):
        assert mission.elements[source].links_to is mission.elements[target]  # type: ignore[attr-defined]


def test_a_container_without_start_events_does_not_begin_at_its_link_target() -> None:
    ends = throw("a") + catch("a")
    inner = f'<subProcess id="T">{ends}<task id="U"/>{flow("L2", "U")}</subProcess>'
    assert [each.id for each in sub(load(around(inner)), "T").entries] == ["L1"]


WRONG_LINKS = {
    "no target": (linked(throw("a"), catch("b")), [("dangling-link", 3, "L1")]),
    "two targets": (
        linked(throw("a"), catch("a"), catch("a", "L3"), more=flow("L3", "E")),
        [("duplicate-link", 5, "L3")],
    ),
    "a target in a subprocess": (
        process(
            f"{throw('a')}\n<subProcess id='X'>{throw('a', 'in')}{catch('a')}{TASK}"
            f"<task id='B'/>{flow('B', 'in')}{flow('L2', 'T')}</subProcess>\n"
            f"{line_of('X')}{flow('X', 'L1')}"
        ),
        [("link-crosses-border", 3, "L1")],
    ),
    "no name": (linked(throw(""), catch("a")), [("link-name", 3, "L1")]),
    "a flow out of a source": (
        linked(throw("a"), catch("a"), more=f"\n{flow('L1', 'E')}"),
        [("link-throw-outgoing", 6, "L1-E")],
    ),
    "a flow into a target": (
        linked(throw("a"), catch("a"), more=f"\n{flow('S', 'L2')}"),
        [("link-catch-incoming", 6, "S-L2")],
    ),
    "a link as a start event": (
        process(
            '<startEvent id="S"><linkEventDefinition name="a"/></startEvent><endEvent id="E"/>'
            + flow("S", "E")
        ),
        [("start-trigger", 3, "S")],
    ),
}


@pytest.mark.parametrize("case", WRONG_LINKS)
def test_a_link_is_refused(case: str) -> None:
    data, expected = WRONG_LINKS[case]
    assert summary(data) == expected


def test_the_finding_of_a_missing_target_names_a_near_one_or_says_where_it_is() -> None:
    [near] = findings(linked(throw("home"), catch("hone")))
    assert (near.message, near.remedy) == (
        "the link 'home' has no target",
        "did you mean 'hone'?",
    )
    [elsewhere] = findings(WRONG_LINKS["a target in a subprocess"][0])
    assert "'L2' is in another process or subprocess" in elsewhere.message


def test_a_target_that_nothing_leads_to_is_unreachable() -> None:
    [found] = lint(load(process(f"{catch('a', 'L2')}{TASK}{line_of('T')}")))
    assert (found.rule, found.element) == ("unreachable", "L2")
    assert found.remedy == "add a link throw event of the name 'a', or delete it"
