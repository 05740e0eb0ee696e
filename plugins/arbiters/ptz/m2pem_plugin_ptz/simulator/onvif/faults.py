"""Faults of the simulated camera: by calls, or as text (`silent at 10 s for 5 s`).

A fault without `at` begins at once, one without `for` stays.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable

from m2pem.api.faults import NUMBER, Effect, FaultGrammar, FaultKind, PlannedFault, fixed
from m2pem.api.latest_task import LatestTask
from m2pem_plugin_ptz.simulator.onvif.camera import Camera

REBOOT_S = 5.0

Switch = Callable[[], Awaitable[None]]


class Faults:
    """The faults of one camera, which are switched while it runs."""

    def __init__(self, camera: Camera, switch_on: Switch, switch_off: Switch) -> None:
        self._camera = camera
        self._on, self._off = switch_on, switch_off
        self._planned = LatestTask()

    def silent(self, on: bool) -> None:
        """Take requests, and do not answer them."""
        speaks = self._camera.fault_state.speaks
        (speaks.clear if on else speaks.set)()

    def slow(self, seconds: float) -> None:
        """Add a latency."""
        self._camera.fault_state.slow_s = seconds

    def locked(self, on: bool) -> None:
        """Accept no user and no password."""
        self._camera.fault_state.locked = on

    def stuck(self, on: bool) -> None:
        """Stop the pan and tilt motors, whatever is answered."""
        self._camera.advance()
        self._camera.gimbal.pan.stuck = self._camera.gimbal.tilt.stuck = on

    def refuse(self, text: str) -> None:
        """Answer moves with a SOAP fault; "" ends it."""
        self._camera.fault_state.fault = text

    def clock(self, seconds: float) -> None:
        """Advance the clock."""
        self._camera.skew_s += seconds

    async def switch_off(self) -> None:
        """Stop the server."""
        await self._off()

    async def switch_on(self) -> None:
        """Restart: the motors are at zero."""
        self._camera.restart()
        await self._on()

    def plan(self, fault: PlannedFault["Faults"]) -> None:
        """Plan a fault. Its time counts from now."""
        self._planned.add(_happen(fault, self))

    async def close(self) -> None:
        """Cancel all planned faults."""
        await self._planned.close()


async def _happen(fault: PlannedFault[Faults], faults: Faults) -> None:
    """Wait for the time of a fault, and apply it."""
    await asyncio.sleep(fault.at_s or 0.0)
    await _done(fault.effect.begin(faults))
    if fault.for_s is not None and fault.effect.end is not None:
        await asyncio.sleep(fault.for_s)
        await _done(fault.effect.end(faults))


async def _done(result: object) -> None:
    if isinstance(result, Awaitable):
        await result


Match = re.Match[str]


def _slow(match: Match) -> Effect[Faults]:
    return Effect(lambda faults: faults.slow(float(match[1])), lambda faults: faults.slow(0.0))


def _refuse(match: Match) -> Effect[Faults]:
    return Effect(lambda faults: faults.refuse(match[1]), lambda faults: faults.refuse(""))


def _clock(match: Match) -> Effect[Faults]:
    seconds = float(match[1])
    return Effect(lambda faults: faults.clock(seconds), lambda faults: faults.clock(-seconds))


def _switch(switch: Callable[[Faults, bool], None]) -> Callable[[Match], Effect[Faults]]:
    return fixed(lambda faults: switch(faults, True), lambda faults: switch(faults, False))


GRAMMAR = FaultGrammar(
    {
        "silent": FaultKind("silent", _switch(Faults.silent)),
        "slow 2 s": FaultKind(rf"slow\s+{NUMBER}\s*s", _slow),
        "refuse auth": FaultKind(r"refuse\s+auth", _switch(Faults.locked)),
        'refuse "text"': FaultKind(r"refuse\s+\"([^\"]+)\"", _refuse),
        "stuck": FaultKind("stuck", _switch(Faults.stuck)),
        "clock +3600 s": FaultKind(r"clock\s+([+-]?\d+(?:\.\d+)?)\s*s", _clock),
        "reboot": FaultKind("reboot", fixed(Faults.switch_off, Faults.switch_on), REBOOT_S),
    },
    "silent at 10 s for 5 s",
)
