"""What a revision or a choice arms is armed as in a run that came there by itself.

The judge of each way is the fresh run: it has the new version from its start. Whatever way a token
comes to an element, its events see the same: messages kept before, signals after, conditions that
are true, dates that have passed, durations and cycles.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from random import Random
from typing import Any, Self

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.run import MissionRun
from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.journal.base import Entry
from m2pem.journal.codec import decode_body, encode_body
from m2pem.mission.elements import ErrorPolicy
from tests.engine.kit import FAILED, Play
from tests.engine.notation import mission
from tests.seeds import seeds_for

MAIN = """
<process id="MAIN" isExecutable="true">
    <startEvent id="start"/> <endEvent id="end"/> <scriptTask id="init">x = 1</scriptTask>
    <intermediateThrowEvent id="first">message m</intermediateThrowEvent>
    <intermediateThrowEvent id="second">message m</intermediateThrowEvent>
    <scriptTask id="before">do goto uav1</scriptTask> <userTask id="job"/>
    start -> init -> first -> second -> before -> job -> end
    {}
</process>
{}
"""
PLAIN = MAIN.format("", "")
TAIL = '<scriptTask id="got">y = 1</scriptTask>\nev -> got\n'
INSIDE = '<scriptTask id="got">y = 1</scriptTask> <endEvent id="done"/>\nev -> got -> done\n'


def at_job(event: str, *, interrupting: bool = True) -> str:
    cancel = str(interrupting).lower()
    boundary = f'<boundaryEvent id="ev" attachedToRef="job" cancelActivity="{cancel}">'
    return MAIN.format(f"{boundary}{event}</boundaryEvent> {TAIL}", "")


BOX = """<subProcess id="job"> <startEvent id="in"/> <userTask id="inner"/> <endEvent id="out"/>
    in -> inner -> out
    {}</subProcess>"""


def boxed(inside: str = "") -> str:
    return PLAIN.replace('<userTask id="job"/>', BOX.format(inside))


def beside_job(event: str, *, interrupting: bool = True) -> str:
    start = f'<startEvent id="ev" isInterrupting="{str(interrupting).lower()}">{event}</startEvent>'
    return boxed(f'<subProcess id="sub" triggeredByEvent="true">{start} {INSIDE}</subProcess>')


def another(event: str) -> str:
    inside = f'<startEvent id="ev">{event}</startEvent> {INSIDE}'
    return MAIN.format("", f'<process id="OTHER" isExecutable="true">{inside}</process>')


def waiting(job: str) -> str:
    return MAIN.format(TAIL.replace("ev", "job"), "").replace('<userTask id="job"/>', job)


def gateway(event: str) -> str:
    events = f"""
        <intermediateCatchEvent id="ev">{event}</intermediateCatchEvent>
        <intermediateCatchEvent id="late">signal never</intermediateCatchEvent>
        job -> ev
        job -> late -> end
        {TAIL}
    """
    text = MAIN.format(events, "").replace('<userTask id="job"/>', '<eventBasedGateway id="job"/>')
    return text.replace("-> job -> end", "-> job")


@dataclass(frozen=True)
class Kind:
    """What is new in the new version. `old`: the version before; None: one without any event."""

    new: str
    happens: Callable[[Play], object] = lambda play: None
    old: str | None = None


CATCH = '<intermediateCatchEvent id="job">{}</intermediateCatchEvent>'
CATCH_OTHER = waiting(CATCH.format("message other"))
RECEIVE = '<receiveTask id="job" messageRef="{}"/>'


def a_signal(play: Play) -> None:
    play.signal("s").signal("s")


def ten_seconds(play: Play) -> None:
    play.advance(10)


KINDS = {
    "boundary-message": Kind(at_job("message m")),
    "boundary-message-again": Kind(at_job("message m", interrupting=False)),
    "boundary-signal": Kind(at_job("signal s"), a_signal),
    "boundary-signal-again": Kind(at_job("signal s", interrupting=False), a_signal),
    "boundary-condition": Kind(at_job("conditional x > 0")),
    "boundary-condition-again": Kind(at_job("conditional x > 0", interrupting=False)),
    "boundary-duration": Kind(at_job("timer PT5S"), ten_seconds),
    "boundary-date-past": Kind(at_job("date 2025-12-31T00:00:00Z"), ten_seconds),
    "boundary-date-to-come": Kind(at_job("date 2026-01-01T00:00:05Z"), ten_seconds),
    "boundary-cycle": Kind(at_job("cycle R3/PT2S", interrupting=False), ten_seconds),
    "subprocess-message": Kind(beside_job("message m"), old=boxed()),
    "subprocess-message-again": Kind(beside_job("message m", interrupting=False), old=boxed()),
    "subprocess-signal-again": Kind(
        beside_job("signal s", interrupting=False), a_signal, old=boxed()
    ),
    "subprocess-condition": Kind(beside_job("conditional x > 0"), old=boxed()),
    "subprocess-duration": Kind(beside_job("timer PT5S"), ten_seconds, old=boxed()),
    "subprocess-date-past": Kind(beside_job("date 2025-12-31T00:00:00Z"), ten_seconds, old=boxed()),
    "subprocess-cycle": Kind(
        beside_job("cycle R3/PT2S", interrupting=False), ten_seconds, old=boxed()
    ),
    "process-message": Kind(another("message m")),
    "process-signal": Kind(another("signal s"), a_signal),
    "process-condition": Kind(another("conditional x > 0")),
    "process-duration": Kind(another("timer PT5S"), ten_seconds),
    "process-cycle": Kind(another("cycle R3/PT2S"), ten_seconds),
    "catch-message": Kind(waiting(CATCH.format("message m")), old=CATCH_OTHER),
    "catch-signal": Kind(waiting(CATCH.format("signal s")), a_signal, CATCH_OTHER),
    "catch-condition": Kind(waiting(CATCH.format("conditional x > 0")), old=CATCH_OTHER),
    "catch-date-past": Kind(
        waiting(CATCH.format("date 2025-12-31T00:00:00Z")), ten_seconds, CATCH_OTHER
    ),
    "receive": Kind(waiting(RECEIVE.format("m")), old=waiting(RECEIVE.format("other"))),
    "gateway-message": Kind(gateway("message m"), old=gateway("message other")),
    "gateway-signal": Kind(gateway("signal s"), a_signal, gateway("message other")),
    "gateway-condition": Kind(gateway("conditional x > 0"), old=gateway("message other")),
}


Make = Callable[..., Play]
Way = Callable[..., Play]


def played(text: str, make: Make = Play) -> Play:
    """A run whose errors open incidents, at the task before the job."""
    parsed = mission(text)
    fleet: Fleet = replace(fleet_for(parsed), on_error=ErrorPolicy.INCIDENT)
    return make(parsed, fleet=fleet).start(process="MAIN")


def resume(play: Play) -> None:
    """What a process that was killed leaves is its journal: another one goes on with that."""
    play.run = MissionRun(play.mission, play.fleet, "r1")
    for step in play.steps:
        entry = Entry("r1", 1, step.seq, step.at_us, step.t_us, step.input, tuple(step.records))
        item, records = decode_body(encode_body(entry))
        play.run.replay(records, item)
    play.give(i.ClaimRun(play.run.state.epoch + 1))


def fresh(kind: Kind, make: Make = Play) -> Play:
    return played(kind.new, make).report("before")


def revised(kind: Kind, make: Make = Play) -> Play:
    return played(kind.old or PLAIN, make).report("before").revise(kind.new)


def moved(kind: Kind, make: Make = Play) -> Play:
    return played(kind.old or PLAIN, make).revise(kind.new, before="job")


def skipped(kind: Kind, make: Make = Play) -> Play:
    play = played(kind.old or PLAIN, make).report("before", FAILED).revise(kind.new)
    return play.resolve("skip")


def moved_by_choice(kind: Kind, make: Make = Play) -> Play:
    play = played(kind.old or PLAIN, make).report("before", FAILED).revise(kind.new)
    return play.resolve("move", to="job")


def resumed_before(kind: Kind, make: Make = Play) -> Play:
    play = played(kind.old or PLAIN, make).report("before")
    resume(play)
    return play.revise(kind.new)


def resumed_after(kind: Kind, make: Make = Play) -> Play:
    play = revised(kind, make)
    if not play.ended:
        resume(play)
    return play


def paused(kind: Kind, make: Make = Play) -> Play:
    play = played(kind.old or PLAIN, make).report("before").pause().revise(kind.new)
    return play.resume()


WAYS = (revised, paused, moved, skipped, moved_by_choice, resumed_before, resumed_after)


def outcome(kind: Kind, way: Way, make: Make = Play) -> tuple[int, list[str], str]:
    """How often the event has led on, where tokens are then, and how the run has ended."""
    play = way(kind, make)
    if not play.ended:
        kind.happens(play)
    entered = [each for each in play.records() if isinstance(each, r.TokenEntered)]
    got = sum(each.element == "got" for each in entered)
    return got, sorted(play.at.split()), play.ended


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("kind", KINDS)
def test_events_are_armed_as_in_a_run_that_came_there_by_itself(kind: str, way: Way) -> None:
    expected = outcome(KINDS[kind], fresh)
    assert expected[0] > 0, "the fresh run sees the event"
    assert outcome(KINDS[kind], way) == expected


def driving(text: str) -> str:
    return text.replace('<userTask id="job"/>', '<scriptTask id="job">do goto uav2</scriptTask>')


def stopped(kind: Kind, make: Make = Play) -> Play:
    play = played(driving(PLAIN), make).report("before").report("job", FAILED)
    return play.revise(driving(kind.new))


def stopped_and_resumed(kind: Kind, make: Make = Play) -> Play:
    play = played(driving(PLAIN)).report("before").report("job", FAILED)
    resume(play)
    play.revise(driving(kind.new))
    if not play.ended:
        resume(play)
    return play


@pytest.mark.parametrize("way", [stopped, stopped_and_resumed], ids=lambda way: way.__name__)
@pytest.mark.parametrize("kind", [each for each in KINDS if each.startswith("boundary")])
def test_a_boundary_event_that_is_new_at_a_task_with_an_incident_is_armed(
    kind: str, way: Way
) -> None:
    assert outcome(KINDS[kind], way) == outcome(KINDS[kind], fresh)


def test_a_boundary_event_that_was_armed_at_an_incident_is_not_armed_again_by_a_retry() -> None:
    play = stopped(KINDS["boundary-signal"]).resolve("retry")
    awaited = [each for each in play.records() if isinstance(each, r.EventAwaited)]
    assert [each.element for each in awaited] == ["ev"]
    assert play.signal("s").at == ""
    assert play.orders()[-1] == "cancel b3"


WRONG = at_job("timer ${x}")


def test_what_cannot_be_armed_opens_no_second_incident_and_hides_no_other_event() -> None:
    second = '<boundaryEvent id="two" attachedToRef="job">signal s</boundaryEvent>\ntwo -> got'
    play = played(driving(PLAIN)).report("before").report("job", FAILED)
    play.revise(driving(WRONG.replace("ev -> got", f"{second}\nev -> got")))
    assert len(play.run.state.incidents) == 1
    assert play.signal("s").ended == "completed"


def test_what_a_wrong_timer_of_a_revision_has_ended_is_not_armed() -> None:
    wrong = """
        <boundaryEvent id="late" attachedToRef="job">timer ${x * 'a'}</boundaryEvent>
        <boundaryEvent id="wrong" attachedToRef="job">error EXPRESSION</boundaryEvent>
        late -> end
        wrong -> end
    </process>"""
    new = beside_job("signal go").replace("</process>", wrong, 1)
    assert played(boxed()).report("before").revise(new).ended == "completed"


def test_of_a_boundary_event_and_an_event_subprocess_the_subprocess_has_waited_longer() -> None:
    start = '<startEvent id="go">message m</startEvent>'
    inside = f'<subProcess id="sub" triggeredByEvent="true">{start}</subProcess>'
    both = at_job("message m").replace("    <boundaryEvent", f"    {inside}<boundaryEvent")
    play = played(PLAIN).report("before").revise(both)
    entered = [each.element for each in play.records() if isinstance(each, r.TokenEntered)]
    assert "go" in entered
    assert "ev" not in entered


def test_events_after_a_gateway_that_a_revision_brings_take_one_message_together() -> None:
    old = gateway("message other").replace(" -> second", "")
    new = gateway("message m").replace(" -> second", "").replace("signal never", "message m")
    play = played(old).report("before").revise(new)
    entered = [each.element for each in play.records() if isinstance(each, r.TokenEntered)]
    assert ("got" in entered) != ("late" in entered)


def test_the_plan_says_which_process_begins_with_kept_messages() -> None:
    plan = played(PLAIN).report("before").plan(another("message m"))
    said = "start event ev takes messages that were kept and nothing waits for"
    assert [(each.element, each.text) for each in plan.effects] == [("ev", said)]


def test_messages_that_nothing_receives_are_kept_up_to_a_bound() -> None:
    text = """
        <startEvent id="start"/> <task id="more"/> <exclusiveGateway id="again" default="out"/>
        <scriptTask id="count">n = n + 1</scriptTask> <userTask id="job"/>
        <intermediateThrowEvent id="tell">message m</intermediateThrowEvent>
        start -> more -> tell -> count -> again
        again -> more if n < 1500
        out: again -> job
    """
    play = Play(mission(text)).start({"n": 0})
    assert len(play.run.state.kept_messages["m"]) == 1000
    event = '<boundaryEvent id="ev" attachedToRef="job" cancelActivity="false">message m'
    play.revise(f"{text}\n{event}</boundaryEvent>")
    assert play.run.state.kept_messages == {}


class Killed(Play):
    """A play whose process is killed after some of its inputs, at random."""

    def __init__(self, *words: Any, random: Random, **options: Any) -> None:
        super().__init__(*words, **options)
        self._random = random

    def give(self, item: i.Input) -> Self:
        super().give(item)
        if not self.ended and not isinstance(item, i.ClaimRun) and self._random.random() < 0.5:
            resume(self)
        return self


def all_end_as_the_fresh_run(seeds: Iterable[int]) -> None:
    for seed in seeds:
        random = Random(seed)
        kind, way = random.choice(list(KINDS)), random.choice(WAYS)
        found = outcome(KINDS[kind], way, partial(Killed, random=random))
        assert found == outcome(KINDS[kind], fresh), f"{seed}: {kind}, {way.__name__}"


def test_kills_around_revisions_and_choices_lose_nothing_and_deliver_nothing_twice() -> None:
    all_end_as_the_fresh_run(range(20))


@pytest.mark.long
def test_many_kills_around_revisions_and_choices_lose_nothing_and_deliver_nothing_twice() -> None:
    all_end_as_the_fresh_run(seeds_for(60.0))
