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
    assert first == ["anna (operator) at page, watches r1", "anna@gcs1 at terminal"]
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
