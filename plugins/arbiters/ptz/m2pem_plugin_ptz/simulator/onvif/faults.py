"""Faults of the simulated camera: by calls, or as text (`silent at 10 s for 5 s`).

A fault without `at` begins at once, one without `for` stays.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from m2pem_plugin_ptz.simulator.onvif.camera import Camera

REBOOT_S = 5.0
EXAMPLE = '"silent at 10 s for 5 s"'

Switch = Callable[[], Awaitable[None]]


class FaultTextError(ValueError):
    """The text is not a fault; the message says what is right."""


class Faults:
    """The faults of one camera, which are switched while it runs."""

    def __init__(self, camera: Camera, switch_on: Switch, switch_off: Switch) -> None:
        self._camera = camera
        self._on, self._off = switch_on, switch_off
        self._tasks: set[asyncio.Task[None]] = set()

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

    def fault(self, text: str) -> None:
        """Answer moves with a fault; "" ends it."""
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

    def plan(self, fault: "PlannedFault") -> None:
        """Plan a fault. Its time counts from now."""
        task = asyncio.get_running_loop().create_task(fault.happen(self))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """Cancel all planned faults."""
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


Action = Callable[[Faults], Awaitable[None] | None]


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """`begin` after `at_s` seconds, and `end` after `for_s` more (None: never)."""

    begin: Action
    end: Action
    at_s: float = 0.0
    for_s: float | None = None

    async def happen(self, faults: Faults) -> None:
        """Wait for the time of the fault, and apply it."""
        await asyncio.sleep(self.at_s)
        await _done(self.begin(faults))
        if self.for_s is not None:
            await asyncio.sleep(self.for_s)
            await _done(self.end(faults))


async def _done(result: Awaitable[None] | None) -> None:
    if result is not None:
        await result


_NUMBER = r"(-?\d+(?:\.\d+)?)"
_ACTIONS: dict[str, tuple[str, Callable[[re.Match[str]], tuple[Action, Action]]]] = {
    "silent": (
        "silent",
        lambda _: (lambda faults: faults.silent(True), lambda faults: faults.silent(False)),
    ),
    "slow 2 s": (
        rf"slow\s+{_NUMBER}\s*s",
        lambda match: (
            lambda faults: faults.slow(float(match[1])),
            lambda faults: faults.slow(0.0),
        ),
    ),
    "refuse auth": (
        r"refuse\s+auth",
        lambda _: (lambda faults: faults.locked(True), lambda faults: faults.locked(False)),
    ),
    "stuck": (
        "stuck",
        lambda _: (lambda faults: faults.stuck(True), lambda faults: faults.stuck(False)),
    ),
    'fault "text"': (
        r"fault\s+\"([^\"]+)\"",
        lambda match: (lambda faults: faults.fault(match[1]), lambda faults: faults.fault("")),
    ),
    "clock +3600 s": (
        rf"clock\s+\+?{_NUMBER}\s*s",
        lambda match: (
            lambda faults: faults.clock(float(match[1])),
            lambda faults: faults.clock(-float(match[1])),
        ),
    ),
    "reboot": ("reboot", lambda _: (Faults.switch_off, Faults.switch_on)),
}
_SHAPE = re.compile(
    rf"(?P<what>.*?)(?:\s+at\s+{_NUMBER}\s*s)?(?:\s+for\s+{_NUMBER}\s*s)?", re.DOTALL
)


def parse(text: str) -> PlannedFault:
    """Read `ACTION [at SECONDS s] [for SECONDS s]`.

    Raises:
        FaultWordsError: it is something else.
    """
    shape = _SHAPE.fullmatch(text.strip())
    assert shape is not None, "the pattern takes anything"
    what = shape["what"].strip()
    at_s, for_s = (None if each is None else float(each) for each in shape.groups()[1:])
    for known, (pattern, make) in _ACTIONS.items():
        match = re.fullmatch(pattern, what, re.IGNORECASE)
        if match is not None:
            if known == "reboot" and for_s is None:
                for_s = REBOOT_S
            return PlannedFault(*make(match), at_s or 0.0, for_s)
    raise FaultTextError(
        f"{text!r}: {what!r} is no action. Actions: {'; '.join(_ACTIONS)}. Then 'at 10 s' "
        f"(without: at once) and 'for 5 s' (without: for good), such as {EXAMPLE}"
    )
