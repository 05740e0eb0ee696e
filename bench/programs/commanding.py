"""Missions whose vehicles go where they are told, and an operator who sees how soon they hear it.

Vehicles are v0, v1 and so on, and the points that they are sent to p0, p1 and so on.
"""

import asyncio
import random
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from dataclasses import dataclass
from statistics import quantiles
from typing import Any

from bench.graphs import file
from bench.programs.stage import flows
from m2pem.api import ControlEvent
from m2pem.engine.records import TokenEntered
from m2pem.executive.executive import Executive

PAUSED = 0
"""The vehicle that is on its way, and is paused; the others get signals."""

PAUSE_S = 0.02
PATIENCE_S = 10.0


def going(number: int) -> str:
    """A task that commands a vehicle to go to its point."""
    return (
        f'<scriptTask id="b{number}"><extensionElements>'
        '<m2pem:behavior type="vehicle" name="goto">'
        f'<m2pem:properties><m2pem:property name="target" value="p{number}"/></m2pem:properties>'
        f'<m2pem:resources><m2pem:role name="driver" vehicle="v{number}"/></m2pem:resources>'
        "</m2pem:behavior></extensionElements></scriptTask>"
    )


def signalled(count: int) -> bytes:
    """For each vehicle but the first: its signal has it go, again and again."""
    numbers = range(PAUSED + 1, count)
    roots = "".join(f'<signal id="go{number}" name="go{number}"/>' for number in numbers)
    events = "".join(
        f'<intermediateCatchEvent id="c{number}"><signalEventDefinition signalRef="go{number}"/>'
        f"</intermediateCatchEvent>{going(number)}"
        for number in numbers
    )
    loops = flows(
        ["start", "fork"], *(["fork", f"c{each}", f"b{each}", f"c{each}"] for each in numbers)
    )
    return file(
        f'{roots}<process id="SIGNALLED" isExecutable="true"><startEvent id="start"/>'
        f'<parallelGateway id="fork"/>{events}{loops}</process>'
    )


def on_its_way() -> bytes:
    """One vehicle goes far."""
    return file(
        '<process id="ON_ITS_WAY" isExecutable="true"><startEvent id="start"/>'
        f'{going(PAUSED)}<endEvent id="end"/>{flows(["start", f"b{PAUSED}", "end"])}</process>'
    )


@dataclass(frozen=True, slots=True)
class Orders:
    """What a vehicle gets, in order, when it is to go, to stand, and to go on."""

    go: tuple[int, ...]
    hold: tuple[int, ...]
    resume: tuple[int, ...]


Got = tuple[int, int, int]
"""The number of a vehicle, what it got, and when (ns since the epoch)."""


class Operator:
    """Calls `MissionControl` from a thread of its own, and waits for what the vehicles get.

    `receive`: waits for the next thing that any of them gets.
    """

    def __init__(self, running: Executive, receive: Callable[[], Got], orders: Orders) -> None:
        self._control = running.control
        self._receive = receive
        self._orders = orders
        self._loop = asyncio.get_running_loop()
        self._rng = random.Random(5)

    def wait_for_the_way(self) -> None:
        """Wait until the vehicle of the other mission has been sent off."""
        self._expect(PAUSED, self._orders.go)

    def signals(
        self, run: str, notices: AsyncIterator[ControlEvent], vehicles: int, times: int
    ) -> list[float]:
        """Milliseconds from each signal to the command."""
        took_ms = []
        for number in range(times):
            vehicle = PAUSED + 1 + number % (vehicles - 1)
            wish = self._control.signal(f"go{vehicle}", run=run)
            took_ms.append(self._command(wish, vehicle, self._orders.go))
            self._call(self._back(notices, f"c{vehicle}"))
        return took_ms

    def pauses(self, run: str, times: int) -> list[float]:
        """Milliseconds from each pause to the command."""
        took_ms = []
        for _ in range(times):
            took_ms.append(self._command(self._control.pause(run), PAUSED, self._orders.hold))
            self._command(self._control.resume(run), PAUSED, self._orders.resume)
        return took_ms

    def _command(
        self, wish: Coroutine[Any, Any, None], vehicle: int, orders: tuple[int, ...]
    ) -> float:
        time.sleep(self._rng.uniform(0, PAUSE_S))
        wished_ns = time.time_ns()
        asked = asyncio.run_coroutine_threadsafe(wish, self._loop)
        first_ns = self._expect(vehicle, orders)
        asked.result(PATIENCE_S)
        return (first_ns - wished_ns) / 1e6

    def _expect(self, vehicle: int, orders: tuple[int, ...]) -> int:
        """When the first of these came; no other vehicle is steered meanwhile."""
        came = [self._receive() for _ in orders]
        found = [(number, order) for number, order, _ in came]
        assert found == [(vehicle, order) for order in orders], found
        return came[0][2]

    def _call(self, wish: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(wish, self._loop).result(PATIENCE_S)

    async def _back(self, notices: AsyncIterator[ControlEvent], element: str) -> None:
        async for notice in notices:
            record = getattr(notice, "record", None)
            if isinstance(record, TokenEntered) and record.element == element:
                return


def percentiles(sent_ms: list[float], paused_ms: list[float], *wanted: int) -> dict[str, float]:
    """The figures of signals, and of pauses (`pause_`)."""
    figures: dict[str, float] = {}
    for name, took_ms in (("", sent_ms), ("pause_", paused_ms)):
        cuts = quantiles(took_ms, n=100)
        figures |= {f"{name}p{each}_ms": cuts[each - 1] for each in wanted}
    return figures
