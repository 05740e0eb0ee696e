"""What a host does with requests, reports and a lost contact: in virtual time, without a link."""

import asyncio
import logging
import zlib
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, cast
from uuid import UUID

import pytest
from m2pem_plugin_zenoh import messages as m
from m2pem_plugin_zenoh.arbiter_host import ArbiterHost, LinkError
from m2pem_plugin_zenoh.store import HostStore

from m2pem.api import (
    ArbiterContext,
    BehaviorReport,
    BehaviorRequest,
    BehaviorState,
    Connection,
    CutOffPolicy,
    Detection,
    GeoPosition,
    Host,
    HostedArbiter,
    PayloadState,
    Point,
    ResourceId,
    VehicleState,
    WhenCutOff,
)
from m2pem.api.clock import VirtualClock
from m2pem.telemetry.bus import Bus
from m2pem.testing import FakeArbiter

UGV1, UGV2 = ResourceId("ugv1"), ResourceId("ugv2")
CAMERA = ResourceId("ugv1/camera")
JOURNAL, OTHER_JOURNAL = str(UUID(int=1)), str(UUID(int=2))
Virtual = Callable[[Callable[[VirtualClock], Awaitable[None]]], None]
GOTO = {"target": Point((38.1, -77.3, None)), "speed": 2.0}


class Executive:
    """The other end: keeps what is delivered, and can be out of reach."""

    def __init__(self) -> None:
        self.items: list[m.Item] = []
        self.states: list[VehicleState | PayloadState] = []
        self.is_reached = True
        self.confirms = True
        self._number = 0
        self.contact = ""
        self.host: ArbiterHost | None = None

    @property
    def reports(self) -> list[BehaviorReport]:
        return [m.decode_report(each.content) for each in self.items if each.kind == m.REPORT]

    @property
    def notes(self) -> list[str]:
        return [each.content.decode() for each in self.items if each.kind == m.NOTE]

    @property
    def ended(self) -> list[tuple[str, BehaviorState, str]]:
        return [(r.id, r.state, r.reason) for r in self.reports if r.state.terminal]

    async def deliver(self, executive: str, items: m.Items) -> int:
        await asyncio.sleep(0.01)
        if not self.is_reached:
            raise LinkError("no answer")
        self.items += items.items
        if not self.confirms:
            raise LinkError("no answer")
        return items.items[-1].number

    def publish(self, executive: str, states: bytes) -> None:
        self.states += m.decode_states(states)

    async def ask(
        self, body: m.Body, id_: str = "", executive: str = "e1", journal: str = JOURNAL
    ) -> m.Answer:
        assert self.host is not None
        self._number += 1
        request = m.Request(id_ or f"{self._number}", executive, journal, self.contact, body)
        answer: m.Answer = m.decode(await self.host.handle(m.encode(request)), m.Answer)
        if isinstance(answer, m.Welcome):
            self.contact = answer.contact
        return answer

    async def greet(self, *going: str, fresh: bool = False, **who: str) -> m.Answer:
        return await self.ask(m.Hello(m.VERSION, "the executive", fresh, going), **who)

    async def start(
        self, behavior: str, *vehicles: ResourceId, epoch: int = 1, **more: Any
    ) -> m.Answer:
        request = BehaviorRequest(behavior, epoch, "goto", GOTO, vehicles or (UGV1,))
        return await self.ask(m.Start(m.plain_request(request)), **more)


class World:
    """A host with two vehicles and a camera of a fake arbiter, which can be killed."""

    def __init__(self, folder: Path, clock: VirtualClock, policy: CutOffPolicy) -> None:
        self.executive = Executive()
        self.clock = clock
        self.arbiters: list[FakeArbiter] = []
        self.known: dict[str, BehaviorReport] = {}
        self._folder = folder
        connections = {each: Connection(each, "ground") for each in (UGV1, UGV2, CAMERA)}

        def make(context: ArbiterContext) -> FakeArbiter:
            arbiter = FakeArbiter(connections, context)
            arbiter.known = dict(self.known)
            self.arbiters.append(arbiter)
            return arbiter

        self._hosted = HostedArbiter(
            "fleet",
            Host("pi", telemetry_hz=4.0),
            "fake",
            connections,
            dict.fromkeys(connections, policy),
            cast("Any", make),
        )
        self.host: ArbiterHost | None = None

    @property
    def arbiter(self) -> FakeArbiter:
        return self.arbiters[-1]

    async def open(self) -> None:
        logger = logging.getLogger("m2pem.host")
        context = ArbiterContext(self.clock, Bus(), logger, (38.1, -77.3, 0.0))
        store = HostStore(self._folder / "fake.db", logger)
        self.host = self.executive.host = ArbiterHost(self._hosted, context, store, self.executive)
        await self.host.open()

    async def close(self) -> None:
        assert self.host is not None
        await self.host.close()

    async def restart(self) -> None:
        """End the host and start it again; the contact is lost."""
        await self.close()
        await self.open()

    async def hear(self, seconds: float) -> None:
        """Let time pass while the executive is there."""
        for _ in range(round(seconds / 0.5)):
            await self.executive.ask(m.Ping(0.0))
            await self.clock.sleep(0.5)


@pytest.fixture
def policy() -> CutOffPolicy:
    return CutOffPolicy(WhenCutOff.HOLD, 10.0)


@pytest.fixture
def play(virtual: Virtual, tmp_path: Path, policy: CutOffPolicy) -> Callable[..., None]:
    """Runs a test with a host; an executive has contact."""

    def play(main: Callable[[World], Awaitable[None]]) -> None:
        async def in_time(clock: VirtualClock) -> None:
            world = World(tmp_path, clock, policy)
            await world.open()
            try:
                assert isinstance(await world.executive.greet(fresh=True), m.Welcome)
                await main(world)
            finally:
                await world.close()

        virtual(in_time)

    return play


def refused(answer: m.Answer) -> str:
    assert isinstance(answer, m.Refused), answer
    return answer.code


# --- requests -------------------------------------------------------------------------------------


def test_a_request_that_arrives_twice_is_done_once(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        first = await world.executive.start("r1.b1", id_="s1")
        assert first == await world.executive.start("r1.b1", id_="s1")
        await world.executive.start("r1.b1", id_="s2")
        assert world.arbiter.count("start") == 1
        parameters = world.arbiter.requests["r1.b1"].parameters
        assert parameters == GOTO
        await world.executive.ask(m.Cancel("r1.b1", 1), id_="c1")
        await world.executive.ask(m.Cancel("r1.b1", 1), id_="c1")
        assert world.arbiter.count("cancel") == 1

    play(main)


def test_a_behavior_is_begun_once_though_the_host_restarts(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1", id_="s1")
        world.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING, native_ref="g1")
        await world.restart()
        await world.executive.greet("r1.b1")
        await world.executive.start("r1.b1", id_="s1")
        await world.executive.start("r1.b1", epoch=2)
        assert world.arbiter.count("start") == 0
        await world.clock.sleep(1)
        states = [each.state for each in world.executive.reports]
        assert states == [BehaviorState.ACCEPTED, BehaviorState.RUNNING]

    play(main)


@pytest.mark.parametrize(
    ("found", "end"),
    [
        ({"state": BehaviorState.UNKNOWN}, (BehaviorState.LOST, "LINK_LOST")),
        (
            {"state": BehaviorState.UNKNOWN, "not_begun": True},
            (BehaviorState.REJECTED, "REJECTED"),
        ),
        ({"state": BehaviorState.FAILED, "code": "NO_FUEL"}, (BehaviorState.FAILED, "NO_FUEL")),
    ],
)
def test_what_became_of_a_behavior_while_the_host_was_down_is_reported(
    play: Callable[..., None], found: dict[str, Any], end: tuple[BehaviorState, str]
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        world.arbiter.report("r1.b1", BehaviorState.ACCEPTED)
        world.arbiter.report("r1.b1", BehaviorState.RUNNING)
        await world.clock.sleep(1)
        world.known["r1.b1"] = BehaviorReport("r1.b1", 1, **found)
        await world.restart()
        await world.executive.greet("r1.b1")
        await world.clock.sleep(1)
        last = world.executive.reports[-1]
        assert (last.state, last.code) == end
        assert [each.number for each in world.executive.reports] == [1, 2, 3]

    play(main)


def test_a_start_that_was_on_its_way_while_the_contact_was_lost_is_refused(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.clock.sleep(6)
        assert refused(await world.executive.start("r1.b1")) == "NO_CONTACT"
        assert refused(await world.executive.ask(m.Resume(UGV1))) == "NO_CONTACT"
        old = world.executive.contact
        await world.executive.greet()
        new, world.executive.contact = world.executive.contact, old
        assert refused(await world.executive.start("r1.b1")) == "NO_CONTACT"
        world.executive.contact = new
        assert isinstance(await world.executive.start("r1.b1"), m.Done)
        assert world.arbiter.count("start") == 1

    play(main)


def test_what_stops_a_vehicle_is_done_without_contact(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        await world.clock.sleep(6)
        assert isinstance(await world.executive.ask(m.Hold(UGV1)), m.Done)
        assert isinstance(await world.executive.ask(m.Cancel("r1.b1", 1)), m.Done)
        assert (world.arbiter.count("hold"), world.arbiter.count("cancel")) == (1, 1)

    play(main)


def test_a_past_epoch_is_refused_with_the_newer_one_after_a_restart_too(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1", epoch=4)
        await world.restart()
        await world.executive.greet()
        for answer in (
            await world.executive.start("r1.b2", epoch=3),
            await world.executive.ask(m.Cancel("r1.b1", 3)),
        ):
            assert isinstance(answer, m.Refused)
            assert (answer.code, answer.newest) == ("STALE_EPOCH", 4)
            assert "epoch 4" in answer.reason
        assert isinstance(await world.executive.start("r2.b1", epoch=1), m.Done)

    play(main)


def test_an_arbiter_that_raises_on_start_rejects_the_behavior(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        world.arbiter.raises["start"] = RuntimeError("no more goals")
        await world.executive.start("r1.b1")
        await world.clock.sleep(1)
        ((_, state, reason),) = world.executive.ended
        assert state is BehaviorState.REJECTED
        assert "no more goals" in reason

    play(main)


# --- who has it -----------------------------------------------------------------------------------


def test_a_restarted_executive_takes_over_and_the_former_one_never_gets_it_back(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        assert isinstance(await world.executive.greet(fresh=True, executive="e2"), m.Welcome)
        assert refused(await world.executive.ask(m.Ping(0.0), executive="e1")) == "SUPERSEDED"
        assert refused(await world.executive.greet(executive="e1")) == "SUPERSEDED"
        await world.restart()
        assert refused(await world.executive.greet(executive="e1")) == "SUPERSEDED"
        assert isinstance(await world.executive.greet(executive="e2"), m.Welcome)

    play(main)


def test_another_journal_gets_the_host_only_when_nothing_goes_on(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        other = {"executive": "e2", "journal": OTHER_JOURNAL}
        assert refused(await world.executive.greet(**other)) == "IN_USE"
        await world.executive.start("r1.b1", epoch=5)
        await world.clock.sleep(6)
        answer = await world.executive.greet(**other)
        assert isinstance(answer, m.Refused)
        assert "r1.b1" in answer.reason
        world.arbiter.report("r1.b1", BehaviorState.SUCCEEDED)
        await world.clock.sleep(1)
        assert isinstance(await world.executive.greet(fresh=True, **other), m.Welcome)
        assert world.arbiter.context.journal == UUID(OTHER_JOURNAL)
        # Its ids and epochs begin again, and the reports of the other one are not for it.
        await world.executive.start("r1.b1", epoch=1, **other)
        assert world.arbiter.count("start") == 1
        assert world.executive.ended == []

    play(main)


def test_another_version_of_the_link_is_refused(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        hello = m.Hello(m.VERSION + 1, "x", True)
        assert refused(await world.executive.ask(hello)) == "VERSION"
        assert world.host is not None
        answer = m.decode(await world.host.handle(b"\x00junk"), m.Answer)
        assert refused(answer) == "VERSION"

    play(main)


# --- reports --------------------------------------------------------------------------------------


def test_reports_wait_on_the_disk_until_they_are_received_in_their_order(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        world.executive.is_reached = False
        for state in (BehaviorState.ACCEPTED, BehaviorState.RUNNING):
            world.arbiter.report("r1.b1", state)
        await world.hear(2)
        world.known["r1.b1"] = BehaviorReport("r1.b1", 3, BehaviorState.SUCCEEDED)
        await world.restart()
        world.executive.is_reached = True
        await world.executive.greet("r1.b1")
        await world.clock.sleep(2)
        assert [each.state.value for each in world.executive.reports] == [
            "ACCEPTED",
            "RUNNING",
            "SUCCEEDED",
        ]

    play(main)


def test_items_are_sent_again_until_they_are_confirmed(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        world.executive.confirms = False
        await world.executive.start("r1.b1")
        world.arbiter.report("r1.b1", BehaviorState.ACCEPTED)
        await world.hear(1)
        assert len(world.executive.items) > 1
        assert {each.number for each in world.executive.items} == {1}
        world.executive.confirms = True
        await world.hear(1)
        count = len(world.executive.items)
        await world.hear(1)
        assert len(world.executive.items) == count

    play(main)


def test_a_full_queue_keeps_the_ends_of_behaviors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("m2pem_plugin_zenoh.store.MOST_ITEMS", 4)
    store = HostStore(tmp_path / "a.db", logging.getLogger("m2pem.host"))
    end = BehaviorReport("r1.b1", 3, BehaviorState.SUCCEEDED)
    store.report(end)
    store.state(b"detection")
    for number in range(10):
        store.report(BehaviorReport("r1.b2", number, BehaviorState.RUNNING))
    waiting = [m.decode_report(each.content) for each in store.waiting(100)]
    assert waiting[0] == end
    assert [each.number for each in waiting[1:]] == [7, 8, 9]
    store.close()


# --- telemetry ------------------------------------------------------------------------------------


def test_the_newest_state_is_sent_as_often_as_the_fleet_says(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        for number in range(100):
            if number % 20 == 0:
                await world.executive.ask(m.Ping(0.0))
            world.arbiter.say(VehicleState(UGV1, number))
            await world.clock.sleep(0.02)
        times = [each.time_us for each in world.executive.states]
        assert 7 <= len(times) <= 10  # four times a second, in two seconds
        assert times == sorted(times)

    play(main)


def test_a_slow_link_gets_fewer_states_but_is_not_believed_lost(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        assert world.host is not None
        await world.executive.ask(m.Ping(0.8))
        assert world.host.state_interval_s == 0.8
        await world.executive.ask(m.Ping(20.0))
        # Half of the 3 s and the round trip after which a vehicle is lost.
        assert world.host.state_interval_s == 2.0

    play(main)


def test_states_of_another_version_are_refused() -> None:
    states: list[VehicleState | PayloadState] = [VehicleState(UGV1, 1), PayloadState(CAMERA, 2)]
    content = m.encode_states(states)
    assert m.decode_states(content) == states
    for other in (b"junk", m.encode(m.Ping(None)), content[:-8], zlib.compress(b"\x80")):
        with pytest.raises(m.MessageError):
            m.decode_states(other)


def test_detections_are_not_lost(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        world.executive.is_reached = False
        for number in range(3):
            found = Detection("mine", CAMERA, GeoPosition(38.1, -77.3, 0.0), number)
            world.arbiter.say(PayloadState(CAMERA, number, detections=(found,)))
        await world.clock.sleep(20)
        world.executive.is_reached = True
        await world.executive.greet()
        await world.clock.sleep(1)
        states = [one for each in world.executive.items for one in m.decode_states(each.content)]
        found_at = [
            each.time_us
            for state in states
            if isinstance(state, PayloadState)
            for each in state.detections
        ]
        assert found_at == [0, 1, 2]

    play(main)


# --- without contact ------------------------------------------------------------------------------


def test_a_host_that_is_cut_off_holds_its_vehicle_and_lets_it_go_on_for_the_run(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        await world.hear(2)
        await world.clock.sleep(9)
        assert world.arbiter.count("hold") == 0
        await world.clock.sleep(2)
        assert [call.subject for call in world.arbiter.calls if call.what == "hold"] == [UGV1]
        await world.executive.greet("r1.b1")
        assert world.arbiter.count("resume", UGV1) == 1
        await world.clock.sleep(1)
        assert world.executive.notes == [
            "ugv1 was held, as there was no contact",
            "ugv1 goes on with r1.b1",
        ]

    play(main)


def test_what_a_host_cannot_do_alone_it_tries_again(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        world.arbiter.raises["hold"] = OSError("the serial line is gone")
        await world.clock.sleep(12)
        tried = world.arbiter.count("hold")
        assert tried > 1
        world.arbiter.raises.clear()
        await world.clock.sleep(5)
        assert world.arbiter.count("hold") == tried + 1

    play(main)


def test_a_vehicle_whose_behavior_the_executive_has_given_up_is_held_when_contact_returns(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        await world.executive.start("r1.b2", UGV2)
        await world.clock.sleep(6)
        await world.executive.greet("r1.b2")
        assert world.arbiter.count("hold", UGV1) == 1
        assert world.arbiter.count("hold", UGV2) == 0
        assert world.arbiter.count("resume") == 0

    play(main)


def test_what_the_host_holds_stays_held_for_a_restarted_executive(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        await world.clock.sleep(12)
        await world.executive.greet(fresh=True, executive="e2")
        assert world.arbiter.count("resume") == 0

    play(main)


@pytest.mark.parametrize("by_executive", [True, False])
def test_a_restarted_executive_is_told_of_a_hold_that_came_before_it(
    play: Callable[..., None], by_executive: bool
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        world.arbiter.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)
        if by_executive:
            await world.executive.ask(m.Hold(UGV1))
        await world.clock.sleep(12)
        await world.executive.greet(fresh=True, executive="e2")
        found = await world.executive.ask(m.Query("r1.b1", None, 2), executive="e2")
        assert isinstance(found, m.Found)
        assert m.decode_report(found.report).held
        await world.executive.ask(m.Resume(UGV1), executive="e2")
        found = await world.executive.ask(m.Query("r1.b1", None, 2), executive="e2")
        assert isinstance(found, m.Found)
        assert not m.decode_report(found.report).held

    play(main)


def test_a_restarted_host_lets_go_on_what_it_held_before(play: Callable[..., None]) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        world.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING, held=True)
        await world.clock.sleep(12)
        await world.restart()
        await world.executive.greet("r1.b1")
        assert world.arbiter.count("resume", UGV1) == 1

    play(main)


def test_a_vehicle_that_its_executive_holds_is_not_let_go_on_by_the_host(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        await world.executive.ask(m.Hold(UGV1))
        await world.clock.sleep(12)
        await world.executive.greet("r1.b1")
        assert world.arbiter.count("hold") == 1
        assert world.arbiter.count("resume") == 0

    play(main)


@pytest.mark.parametrize(
    ("policy", "called"),
    [
        (CutOffPolicy(WhenCutOff.CONTINUE, 5.0), []),
        (CutOffPolicy(WhenCutOff.END, 5.0), ["cancel"]),
        (CutOffPolicy(WhenCutOff.HOLD, 5.0, {"goto": WhenCutOff.END}), ["cancel"]),
        (CutOffPolicy(WhenCutOff.HOLD, 60.0), []),
    ],
)
def test_a_host_does_alone_what_the_fleet_says(
    play: Callable[..., None], policy: CutOffPolicy, called: list[str]
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        await world.clock.sleep(30)
        assert [call.what for call in world.arbiter.calls][1:] == called

    play(main)


def test_a_restarted_host_without_contact_does_alone_what_the_fleet_says(
    play: Callable[..., None],
) -> None:
    async def main(world: World) -> None:
        await world.executive.start("r1.b1")
        world.known["r1.b1"] = BehaviorReport("r1.b1", 2, BehaviorState.RUNNING)
        await world.restart()
        await world.clock.sleep(12)
        assert world.arbiter.count("hold", UGV1) == 1

    play(main)
