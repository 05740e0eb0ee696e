"""An arbiter on board: what its vehicle does not take is in the log of the node."""

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast
from uuid import UUID

import pytest
from m2pem_plugin_ros.drivers.driver import DriverEvents
from m2pem_plugin_ros.onboard.arbiter_driver import ArbiterDriver

from m2pem.api import Clock, Connection, ResourceId
from m2pem.api.clock import run_virtual
from m2pem.testing.contracts.arbiter_harness import context
from m2pem.testing.fake_arbiter import FakeArbiter

V, GOAL = ResourceId("v"), UUID(int=1)


class Adjusting(FakeArbiter):
    """Its vehicles answer to new parameters when a test sets the result of `answer`."""

    capabilities = replace(FakeArbiter.capabilities, adjusts=True)
    answer: asyncio.Future[str]

    async def adjust(
        self, behavior: str, epoch: int, parameters: Mapping[str, Any]
    ) -> asyncio.Future[str]:
        await self._called("adjust", behavior)
        self.answer = asyncio.get_running_loop().create_future()
        return self.answer


def test_parameters_that_are_not_taken_are_logged_and_the_next_call_does_not_wait(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def main(clock: Clock) -> None:
        lent = context(clock)
        arbiter = Adjusting({V: Connection(V, "ground")}, lent)
        nothing = cast("DriverEvents", None)  # its vehicle sends no report
        driver = ArbiterDriver(arbiter, V, nothing, lent.bus, logging.getLogger("node"))
        await driver.open()
        driver.adjust(GOAL, {"speed": 3.0})
        driver.hold()
        await arbiter.until_called("hold", V)
        arbiter.answer.set_result("its motors are hot")
        await asyncio.sleep(0.1)
        await driver.close()

    with caplog.at_level(logging.WARNING):
        run_virtual(main, 0)
    assert caplog.messages == ["v may go on as before: its motors are hot"]
