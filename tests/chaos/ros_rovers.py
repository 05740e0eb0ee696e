"""The simulated ROS 2 rovers of a round, which note what they do, in a process of their own.

What drives a rover on board, an m2pem node or a Nav2, begins orders for its base; that is noted,
and each time the base starts to move from a stand, whatever the reason.
"""

import json
import runpy
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from m2pem_plugin_ros.drivers.driver import Driver, DriverEvents, Order, Outcome
from m2pem_plugin_ros.simulator.onboard_control import ControlContext
from m2pem_plugin_ros.simulator.vehicle import Vehicle

STOPS = ("end", "hold", "abandon")
"""Calls of the driver of a base after which it stands."""


def main(notes: Path, words: Sequence[str]) -> None:
    """Simulate as `m2pem WORDS` does. `notes`: a file, a line of JSON for each note: vehicle, kind,
    detail, and the time of `time.monotonic`."""
    file = notes.open("a", buffering=1, encoding="utf-8")

    def note(vehicle: str, kind: str, detail: str = "") -> None:
        file.write(json.dumps([vehicle, kind, detail, time.monotonic()]) + "\n")

    _note_orders(note)
    _note_motions(note)
    sys.argv = ["m2pem", *words]
    runpy.run_module("m2pem", run_name="__main__", alter_sys=True)


def _note_orders(note: Callable[..., None]) -> None:
    make_driver = ControlContext.make_driver

    def noting(context: ControlContext, events: DriverEvents, bus: Any) -> Driver:
        name = context.vehicle.spec.name
        driver: Any = make_driver(context, events, bus)
        begin, ended = driver.begin, events.ended

        def begin_noted(order: Order) -> None:
            target: Any = order.request.parameters.get("target")
            where = "" if target is None else ",".join(map(str, target.position[:2]))
            note(name, "begin", where)
            begin(order)

        def ended_noted(goal: Any, outcome: Outcome) -> None:
            note(name, "ended")
            ended(goal, outcome)

        def noted(call: str) -> Callable[..., None]:
            act: Callable[..., None] = getattr(driver, call)

            def around(*arguments: Any) -> None:
                note(name, "stop" if call in STOPS else call)
                act(*arguments)

            return around

        events.ended = ended_noted  # type: ignore[method-assign]
        driver.begin = begin_noted
        for call in (*STOPS, "resume"):
            setattr(driver, call, noted(call))
        return driver

    ControlContext.make_driver = noting  # type: ignore[method-assign]


def _note_motions(note: Callable[..., None]) -> None:
    pass_until = Vehicle.pass_until

    def noting(vehicle: Vehicle, now_s: float) -> None:
        before = vehicle.body.motions
        pass_until(vehicle, now_s)
        if vehicle.body.motions > before:
            note(vehicle.spec.name, "motion")

    Vehicle.pass_until = noting  # type: ignore[method-assign]
