"""A member of a team waits until the executive may send, and not for what its vehicle answers."""

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import pytest

from m2pem.api.arbiter import Connection
from m2pem.api.clock import Clock, run_virtual
from m2pem.mission.catalogue import BehaviorState, ResourceId
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


class Adjusting(FakeArbiter):
    """Its vehicles answer to a new speed when a test sets the result of `answer`."""

    capabilities = replace(FakeArbiter.capabilities, adjusts=True)
    answer: asyncio.Future[str]

    async def adjust(
        self, behavior: str, epoch: int, parameters: Mapping[str, Any]
    ) -> asyncio.Future[str]:
        await self._called("adjust", f"{behavior} {parameters['speed']:g}")
        self.answer = asyncio.get_running_loop().create_future()
        return self.answer


def test_a_speed_that_is_not_taken_is_logged_and_the_next_one_does_not_wait(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def main(clock: Clock) -> None:
        arbiter = Adjusting({A: Connection(A, "ground")}, context(clock))
        member = Member(A, arbiter, lambda *_: None, lambda _: None, lambda: True)
        member.begin("r1.b1.a", Leg(A, "goto", MappingProxyType({})), 1, (), clock.now_us())
        await arbiter.until_called("start", "r1.b1.a")
        member.state = BehaviorState.RUNNING
        member.go(3.0, 1)
        await arbiter.until_called("adjust", "r1.b1.a 3")
        await asyncio.sleep(0.1)
        first = arbiter.answer
        member.go(5.0, 1)
        await arbiter.until_called("adjust", "r1.b1.a 5")
        assert not first.done()
        first.set_result("its motors are hot")
        await asyncio.sleep(0.1)
        member.close()

    with caplog.at_level(logging.WARNING):
        run_virtual(main, 0)
    assert caplog.messages == ["a may keep its speed: its motors are hot"]
