"""Event subprocesses, conditional events and links: what reading makes of them, or refuses."""

import pytest
from bpmn_text import around, flow, line_of, load, process, summary

from m2pem.model.elements import Mission, SubProcess

TASK = '<task id="T"/>'
SIGNAL = '<signal id="go"/>'


def handler(start: str, identifier: str = "H", more: str = "") -> str:
    """An event subprocess with one start event, `hs`, on one line."""
    return (
        f'<subProcess id="{identifier}" triggeredByEvent="true">{start}<task id="ht"/>'
        f"{flow('hs', 'ht')}{more}</subProcess>"
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


def test_it_is_no_entry_of_a_container_without_start_events() -> None:
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
    inner = handler(on_signal(), "I").replace("hs", "is").replace("ht", "it")
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
        [("event-not-allowed", 3, "hs")],
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
def test_it_is_refused(case: str) -> None:
    data, expected = REFUSED[case]
    assert summary(data) == expected
