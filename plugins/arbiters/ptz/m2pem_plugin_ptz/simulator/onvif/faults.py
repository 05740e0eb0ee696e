"""What goes wrong with the simulated camera: by calls, or in words (`silent at 10 s for 5 s`).

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


class FaultWordsError(ValueError):
    """Not understood; the text says what would be."""


class Faults:
    """All that can go wrong with one camera, to be switched on and off while it runs."""

    def __init__(self, camera: Camera, switch_on: Switch, switch_off: Switch) -> None:
        self._camera = camera
        self._on, self._off = switch_on, switch_off
        self._tasks: set[asyncio.Task[None]] = set()

    def silent(self, on: bool) -> None:
        """It takes requests, and does not answer them."""
        speaks = self._camera.troubles.speaks
        (speaks.clear if on else speaks.set)()

    def slow(self, seconds: float) -> None:
        """It answers so much later."""
        self._camera.troubles.slow_s = seconds

    def locked(self, on: bool) -> None:
        """No user and no password is right."""
        self._camera.troubles.locked = on

    def stuck(self, on: bool) -> None:
        """Its pan and tilt motors do not turn, whatever it answers."""
        self._camera.advance()
        self._camera.head.pan.stuck = self._camera.head.tilt.stuck = on

    def fault(self, text: str) -> None:
        """It answers moves with a fault; "": no more."""
        self._camera.troubles.fault = text

    def clock(self, seconds: float) -> None:
        """Its clock is so much further ahead."""
        self._camera.skew_s += seconds

    async def switch_off(self) -> None:
        """Nobody listens any more."""
        await self._off()

    async def switch_on(self) -> None:
        """It starts: its head is at zero."""
        self._camera.restart()
        await self._on()

    def plan(self, fault: "PlannedFault") -> None:
        """Let it happen when its time comes."""
        task = asyncio.get_running_loop().create_task(fault.happen(self))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """Nothing more goes wrong."""
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


Action = Callable[[Faults], Awaitable[None] | None]


@dataclass(frozen=True, slots=True)
class PlannedFault:
    """`begin` after `at_s` seconds, `end` after `for_s` more (None: never)."""

    begin: Action
    end: Action
    at_s: float = 0.0
    for_s: float | None = None

    async def happen(self, faults: Faults) -> None:
        """Wait for its time, and do it."""
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
    raise FaultWordsError(
        f"{text!r}: {what!r} is no action. Actions: {'; '.join(_ACTIONS)}. Then 'at 10 s' "
        f"(without: at once) and 'for 5 s' (without: for good), such as {EXAMPLE}"
    )
