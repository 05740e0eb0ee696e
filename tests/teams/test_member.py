"""A member of a team waits until the executive may send."""

import asyncio
from types import MappingProxyType

from m2pem.api.arbiter import Connection
from m2pem.api.clock import Clock, run_virtual
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.member import Member
from m2pem.teams.plan import Leg
from m2pem.testing.contracts.arbiter_harness import context
from m2pem.testing.fake_arbiter import FakeArbiter

A = ResourceId("a")


def test_a_part_does_not_begin_while_the_executive_may_not_send() -> None:
    allowed = False
    failures: list[str] = []

    async def main(clock: Clock) -> None:
        nonlocal allowed
        arbiter = FakeArbiter({A: Connection(A, "ground")}, context(clock))
        member = Member(
            A,
            arbiter,
            lambda _, reason: failures.append(reason),
            lambda _: None,
            lambda: allowed,
        )
        member.begin("r1.b1.a", Leg(A, "goto", MappingProxyType({})), 1, (), clock.now_us())
        await asyncio.sleep(1)
        assert arbiter.count("start") == 0
        allowed = True
        await arbiter.until_called("start", "r1.b1.a")

    run_virtual(main, 0)
    assert failures == []
