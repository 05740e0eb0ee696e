"""Operators ask each other for vehicles: given, refused, or not answered in time."""

import asyncio
from dataclasses import replace

import pytest

from m2pem.api.people import ABSENT_AFTER_S, MAX_NOTE_CHARACTERS
from m2pem.engine import records as r
from m2pem.engine.inputs import ControlRequested, ControlTaken, StartRun
from m2pem.engine.records import RequestOutcome
from m2pem.errors import OperatorError
from m2pem.fleet.fleet import Unanswered
from m2pem.journal import MemoryJournal
from tests.executive.conftest import World, fleet, mission, question, sequence
from tests.executive.test_recovery import left_behind

ASKS = mission(sequence(("Ask", question("Ask"))))
ANNA = r.OperatorTookControl("ugv1", "anna@gcs1")
ASKED = r.ControlRequested("ugv1", "otto", "anna@gcs1")


def ended(outcome: RequestOutcome, by: str = "") -> r.Record:
    return r.ControlRequestEnded("ugv1", "otto", outcome, by)


def of_control(world: World) -> list[r.Record]:
    kinds = r.ControlRequested | r.ControlRequestEnded | r.OperatorTookControl
    return [each for each in world.seen if isinstance(each, kinds)]


async def asked(world: World) -> None:
    """Anna has ugv1, and Otto asks her for it."""
    control = world.executive.control
    await control.start(ASKS)
    await control.take("ugv1", by="anna@gcs1")
    await control.request_control("ugv1", by="otto")


def test_who_has_a_vehicle_gives_it(play):
    async def story(world: World):
        await asked(world)
        control = world.executive.control
        (request,) = await control.control_requests()
        assert (request.by, request.holder, request.left_s) == ("otto", "anna@gcs1", 30.0)
        assert "anna@gcs1 is gone" in str(request)
        with pytest.raises(OperatorError, match="otto asks anna@gcs1 for ugv1 already"):
            await control.request_control("ugv1", by="carla")
        for other in ("otto", "carla"):
            with pytest.raises(OperatorError, match="is with anna@gcs1, whom otto asks"):
                await control.answer_control("ugv1", give=True, by=other)
        await control.answer_control("ugv1", give=True, by="anna@gcs2")
        assert not await control.control_requests()
        return await control.holders(), of_control(world)

    holders, records = play(story, "ugv1")
    assert holders == {"ugv1": "otto"}
    given = ended(RequestOutcome.GIVEN, "anna@gcs2")
    assert records == [ANNA, ASKED, given, r.OperatorTookControl("ugv1", "otto")]


@pytest.mark.parametrize(
    ("by", "outcome"), [("anna", RequestOutcome.REFUSED), ("otto", RequestOutcome.WITHDRAWN)]
)
def test_it_stays_where_it_is_refused_or_withdrawn(play, by: str, outcome: RequestOutcome):
    async def story(world: World):
        await asked(world)
        await world.executive.control.answer_control("ugv1", give=False, by=by)
        await world.clock.sleep(60)
        return await world.executive.control.holders(), of_control(world)

    holders, records = play(story, "ugv1")
    assert (holders, records) == ({"ugv1": "anna@gcs1"}, [ANNA, ASKED, ended(outcome, by)])


@pytest.mark.parametrize(
    ("unanswered", "holder", "outcome"),
    [
        (Unanswered.KEEP, "anna@gcs1", RequestOutcome.EXPIRED),
        (Unanswered.GIVE, "otto", RequestOutcome.GIVEN),
    ],
)
def test_what_the_fleet_says_is_done_without_an_answer(play, unanswered, holder, outcome):
    given = replace(fleet("ugv1"), control_unanswered=unanswered, control_answer_s=10.0)

    async def story(world: World):
        await asked(world)
        await world.clock.sleep(9.9)
        assert (await world.executive.control.holders())["ugv1"] == "anna@gcs1"
        await world.clock.sleep(0.2)
        return await world.executive.control.holders(), of_control(world)

    holders, records = play(story, fleet=given)
    assert holders == {"ugv1": holder}
    assert records[2] == ended(outcome)


def test_giving_it_back_to_the_missions_ends_the_request(play):
    async def story(world: World):
        await asked(world)
        await world.executive.control.give_back("ugv1", by="anna")
        return (
            await world.executive.control.holders(),
            await world.executive.control.control_requests(),
        )

    assert play(story, "ugv1") == ({"ugv1": ""}, [])


def test_what_cannot_be_asked_for_is_said(play):
    async def story(world: World):
        control = world.executive.control
        with pytest.raises(OperatorError, match="no operator has ugv1: take it"):
            await control.request_control("ugv1", by="otto")
        await control.take("ugv1", by="anna@gcs1")
        with pytest.raises(OperatorError, match="you have ugv1 already"):
            await control.request_control("ugv1", by="anna@gcs2")
        with pytest.raises(OperatorError, match="needs a name"):
            await control.request_control("ugv1")
        with pytest.raises(OperatorError, match="no operator asks for ugv1"):
            await control.answer_control("ugv1", give=True, by="anna")

    play(story, "ugv1")


def test_what_the_one_before_commands_by_hand_ends(play):
    async def story(world: World):
        control = world.executive.control
        await control.take("ugv1", by="anna")
        run = await control.execute_behavior("ugv1", "drive_stop", by="anna")
        await world.fake.until_called("start", f"{run}.b1")
        await control.request_control("ugv1", by="otto")
        await control.answer_control("ugv1", give=True, by="anna")
        await world.fake.until_called("cancel", f"{run}.b1")

    play(story, "ugv1")


def test_the_next_executive_asks_again_and_for_the_whole_time(play):
    begin = [StartRun("P"), ControlTaken("ugv1", "anna"), ControlRequested("ugv1", "otto", "anna")]
    journal = left_behind(ASKS, *begin[1:])

    async def story(world: World):
        control = world.executive.control
        await world.executive.resume("r1")
        (request,) = await control.control_requests()
        await control.answer_control("ugv1", give=True, by="anna")
        return request, await control.holders()

    request, holders = play(story, "ugv1", journal=journal)
    assert (request.by, request.holder, request.left_s) == ("otto", "anna", 30.0)
    assert holders == {"ugv1": "otto"}


# --- what another one has -------------------------------------------------------------------------

FORCED = r.OperatorGaveControlBack("ugv1", "otto", "anna", "she has gone home")


async def held_by_anna(world: World) -> None:
    """A run goes on; anna has ugv1, and her page is open."""
    control = world.executive.control
    await control.start(ASKS)
    await control.announce_presence("p1", unit="page", by="anna")
    await control.take("ugv1", by="anna")


async def forced(world: World, by: str = "otto") -> None:
    await world.executive.control.give_back("ugv1", by=by, reason=" she has gone home ")


def returned(world: World) -> list[r.Record]:
    return [each for each in world.seen if isinstance(each, r.OperatorGaveControlBack)]


def test_only_who_has_a_vehicle_gives_it_back_while_they_are_there(play):
    async def story(world: World):
        control = world.executive.control
        await held_by_anna(world)
        for by, reason in (("otto", ""), ("otto", "I want it"), ("", "because")):
            with pytest.raises(OperatorError, match="ugv1 is with anna, who gives it back"):
                await control.give_back("ugv1", by=by, reason=reason)
        assert (await control.holders())["ugv1"] == "anna"
        await control.give_back("ugv1", by="Anna@gcs2")
        return returned(world), await control.alerts()

    assert play(story, "ugv1") == ([r.OperatorGaveControlBack("ugv1", "Anna@gcs2")], [])


def test_what_one_has_who_is_gone_goes_back_with_a_reason_that_all_see(play):
    chosen = replace(fleet("ugv1"), control_gone_after_s=60.0)

    async def story(world: World):
        control = world.executive.control
        await held_by_anna(world)
        await control.end_presence("p1")
        await world.clock.sleep(59)
        with pytest.raises(OperatorError, match=r"at no page or terminal for 60 s \(now: 59 s\)"):
            await forced(world)
        await world.clock.sleep(1)
        with pytest.raises(OperatorError, match="say why you give it back"):
            await control.give_back("ugv1", by="otto", reason=" ")
        await forced(world)
        (alert,) = await control.alerts()
        return await control.holders(), returned(world), alert.code, alert.text

    holders, records, code, text = play(story, fleet=chosen)
    assert (holders, records, code) == ({"ugv1": ""}, [FORCED], "CONTROL_FORCED")
    assert text == "otto has given ugv1 back to the missions, which anna had: she has gone home"


def test_one_who_commands_without_a_unit_is_not_gone(play):
    """At a radio control, or a ground station, that announces no operator."""

    async def story(world: World):
        control = world.executive.control
        await control.start(ASKS)
        await control.take("ugv1", by="anna")
        await world.clock.sleep(50)
        await control.execute_behavior("ugv1", "drive_stop", by="anna")
        await world.clock.sleep(50)
        with pytest.raises(OperatorError, match="now: 50 s"):
            await forced(world)
        await world.clock.sleep(10)
        await forced(world)
        return (await control.holders())["ugv1"]

    assert play(story, "ugv1") == "r2.b1"  # what she commanded goes on, and can be stopped


def test_a_page_whose_machine_dies_does_not_keep_a_vehicle(play):
    async def story(world: World):
        await held_by_anna(world)  # and announces nothing any more
        await world.clock.sleep(61)
        await forced(world)
        return (await world.executive.control.holders())["ugv1"]

    assert play(story, "ugv1") == ""


def test_of_an_operator_without_a_name_it_is_not_known_when_they_were_there(play):
    async def story(world: World):
        control = world.executive.control
        await control.start(ASKS)
        await control.take("ugv1")
        with pytest.raises(OperatorError) as refused:
            await control.give_back("ugv1", by="otto")
        await forced(world)
        return str(refused.value), (await control.holders())["ugv1"]

    why, holder = play(story, "ugv1")
    assert "it is not known when this operator was last at a page or terminal: say why" in why
    assert holder == ""


def test_one_who_is_there_and_does_not_answer_is_asked_first(play):
    """A page may be open, and nobody before it."""

    async def announced(world: World, seconds: int) -> None:
        for _ in range(seconds // 5):
            await world.executive.control.announce_presence("p1", unit="page", by="anna")
            await world.clock.sleep(5)

    async def story(world: World):
        control = world.executive.control
        await held_by_anna(world)
        await control.request_control("ugv1", by="otto")
        await announced(world, 25)
        with pytest.raises(OperatorError, match="or leaves a request for it unanswered"):
            await forced(world)
        await control.answer_control("ugv1", give=False, by="anna")
        with pytest.raises(OperatorError, match="who gives it back"):
            await forced(world)
        await control.request_control("ugv1", by="otto")
        await announced(world, 40)
        await control.execute_behavior("ugv1", "drive_stop", by="anna")
        with pytest.raises(OperatorError, match="who gives it back"):  # she is at it
            await forced(world)
        await control.request_control("ugv1", by="otto")
        await announced(world, 40)
        await forced(world)
        return (await control.holders())["ugv1"]

    assert play(story, "ugv1") == "r2.b1"


def test_where_the_fleet_names_supervisors_they_may_at_once_and_others_not(play):
    operators = {"chief": ("otto",), "pilot": ("anna", "carla")}
    chosen = replace(fleet("ugv1"), supervisor_role="chief", operators=operators)

    async def story(world: World):
        control = world.executive.control
        await held_by_anna(world)
        await control.request_control("ugv1", by="carla")
        for _ in range(7):
            await control.announce_presence("p1", unit="page", by="anna")
            await world.clock.sleep(5)
        with pytest.raises(OperatorError, match="for 60 s, or as chief"):
            await forced(world, "carla")
        with pytest.raises(OperatorError, match="say why"):
            await control.give_back("ugv1", by="otto")
        await forced(world)
        return returned(world)

    assert play(story, fleet=chosen) == [FORCED]


def test_after_a_restart_the_time_of_one_who_is_gone_begins_again(play):
    journal = left_behind(ASKS, ControlTaken("ugv1", "anna"))

    async def story(world: World):
        await world.executive.resume("r1")
        with pytest.raises(OperatorError, match="for 60 s, or"):
            await forced(world)
        await world.clock.sleep(60)
        await forced(world)
        return (await world.executive.control.holders())["ugv1"]

    assert play(story, "ugv1", journal=journal) == ""


# --- who is present -------------------------------------------------------------------------------


def test_who_is_present_is_known_until_their_unit_says_nothing(play):
    async def story(world: World):
        control = world.executive.control
        await control.announce_presence("p1", unit="page", role="operator", run="r1", by="anna")
        await control.announce_presence("t1", unit="terminal", by="anna@gcs1")
        await control.announce_presence("p2", unit="page", by="otto")
        await control.end_presence("p2")
        first = [str(each) for each in await control.operators()]
        await world.clock.sleep(ABSENT_AFTER_S - 1)
        await control.announce_presence("t1", unit="terminal", by="anna@gcs1")
        await world.clock.sleep(2)
        second = [each.unit for each in await control.operators()]
        await control.take("ugv1", by="anna")
        await control.request_control("ugv1", by="otto")
        there = (await control.control_requests())[0].holder_gone
        await world.clock.sleep(ABSENT_AFTER_S)
        return first, second, there, (await control.control_requests())[0].holder_gone

    first, second, there, gone = play(story, "ugv1")
    assert first == ["anna (operator): page, run r1", "anna@gcs1: terminal"]
    assert (second, there, gone) == (["terminal"], False, True)


# --- notes ----------------------------------------------------------------------------------------


def test_a_note_is_in_the_log_also_during_a_pause(play):
    async def story(world: World):
        control = world.executive.control
        run = await control.start(ASKS)
        await control.pause(run)
        await control.add_note(run, "  wind picks up\n", by="anna")
        for wrong in ("", " \n", "x" * (MAX_NOTE_CHARACTERS + 1)):
            with pytest.raises(OperatorError, match="a note has 1 to"):
                await control.add_note(run, wrong, by="anna")
        await control.stop(run)
        await control.wait(run)
        with pytest.raises(OperatorError, match="r1 has ended"):
            await control.add_note(run, "late", by="anna")
        return [each for each in world.seen if isinstance(each, r.OperatorNote)]

    assert play(story, "ugv1") == [r.OperatorNote("wind picks up", "anna")]


class Untold(MemoryJournal):
    """A journal that writes nothing once it is stuck, until it is free again."""

    def __init__(self) -> None:
        super().__init__()
        self.free = asyncio.Event()
        self.free.set()

    async def append(self, *given, **named):
        await self.free.wait()
        return await super().append(*given, **named)


def test_a_request_does_not_take_what_is_given_back_just_now(play):
    """Giving back waits for the journal; the time of the request is over meanwhile."""
    journal = Untold()

    async def story(world: World):
        await asked(world)
        control = world.executive.control
        journal.free.clear()
        returning = asyncio.create_task(control.give_back("ugv1", by="anna"))
        await world.clock.sleep(31.0)
        with pytest.raises(OperatorError, match="was given back to the missions"):
            await control.answer_control("ugv1", give=True, by="anna")
        journal.free.set()
        await returning
        return await control.holders(), await control.control_requests()

    chosen = replace(fleet("ugv1"), control_unanswered=Unanswered.GIVE)
    holders, requests = play(story, fleet=chosen, journal=journal)
    assert holders == {"ugv1": ""}
    assert requests == []
