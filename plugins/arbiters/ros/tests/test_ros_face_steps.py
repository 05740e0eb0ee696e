"""The face leaves the event loop to others, such as STOP, while it opens and closes."""

import asyncio
import threading
from collections.abc import Callable
from functools import wraps
from typing import Any

import pytest
from m2pem_interfaces.msg import FleetState
from rclpy.action import ActionServer
from rclpy.node import Node
from ros_face_client import LATCHED, faced

from m2pem.executive.control import Control
from m2pem.testing import scenarios

VEHICLES = 30
MOST_AT_ONCE = 20
"""Entities of ROS that are made or destroyed between two rounds of the loop: those of the node and
of the fleet."""


class Counter:
    """Counts calls in the thread of the loop, of which the most between two rounds of it."""

    def __init__(self) -> None:
        self.all = self.most = self._now = 0
        self._thread = threading.get_ident()

    def counted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def call(*arguments: Any, **options: Any) -> Any:
            self.all += 1
            if threading.get_ident() == self._thread:
                self._now += 1
                self.most = max(self.most, self._now)
            return function(*arguments, **options)

        return call

    async def each_round(self) -> None:
        while True:
            self._now = 0
            await asyncio.sleep(0)


@pytest.fixture
async def entities(monkeypatch: pytest.MonkeyPatch) -> Counter:
    """Of all nodes in this process."""
    counter = Counter()
    for kind, names in (
        (Node, ("create_publisher", "create_service", "create_subscription")),
        (Node, ("destroy_publisher", "destroy_service", "destroy_subscription")),
        (ActionServer, ("__init__", "destroy")),
    ):
        for name in names:
            monkeypatch.setattr(kind, name, counter.counted(getattr(kind, name)))
    return counter


async def test_a_large_fleet_opens_and_closes_in_small_steps(
    ros_domain: int, entities: Counter, monkeypatch: pytest.MonkeyPatch
) -> None:
    catalogues = Counter()
    monkeypatch.setattr(Control, "catalogue", catalogues.counted(Control.catalogue))
    rounds = asyncio.create_task(entities.each_round())
    fleet = scenarios.fleet("sim", {f"ugv{number}": {} for number in range(VEHICLES)})
    async with faced(ros_domain, of=fleet) as world:
        await world.client.hears("/face/fleet_state", FleetState, LATCHED)
    rounds.cancel()
    assert entities.all > 2 * 5 * VEHICLES
    assert entities.most <= MOST_AT_ONCE
    assert catalogues.all <= 3  # each makes it for the whole fleet
