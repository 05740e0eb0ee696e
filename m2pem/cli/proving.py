"""What `m2pem verify` was told, put together: mission, fleet and options, and who searches."""

import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from m2pem.executive.proving import Asked, Engine
    from m2pem.mission.mission import Mission
    from m2pem.mission.values import Value
    from m2pem.verify.report.findings import Findings
    from m2pem.verify.search.explore import Progress

_QUIET_S = 1.0
"""A search that takes less is over before anybody has read how far it is."""
_BETWEEN_LINES_S = 0.2


def asked_of(
    mission: "Mission",
    fleet_file: str | None,
    process: str | None,
    data: "Mapping[str, Value]",
    spec: Path | None = None,
    *,
    timers_in_order: bool = False,
) -> "Asked":
    """What is to be searched, if `m2pem check` finds no errors in it. `spec`: more requirements.

    Raises:
        MissionError: there are errors; tells them all.
        FleetError: the fleet cannot be used.
        RequirementsError: requirements cannot be read, or do not fit; tells all that is wrong.
    """
    from m2pem.cli.fleets import arbiters_of
    from m2pem.cli.given import get_fleet
    from m2pem.executive import proving
    from m2pem.plugins import PluginManager

    plugins = PluginManager()
    fleet = get_fleet(fleet_file, mission) if fleet_file is not None else None
    arbiters = arbiters_of(fleet, plugins) if fleet is not None else None
    return proving.asked_of(
        mission, arbiters, plugins, process, data, spec, timers_in_order=timers_in_order
    )


def findings(asked: "Asked", engine: "Engine", *, strict: bool) -> "Findings":
    """Search, and tell what was found."""
    from m2pem.executive.proving import prove

    with _ended_as_by_hand(), progress() as show:
        return prove(asked, engine, strict=strict, progress=show)


def promela(asked: "Asked") -> str:
    """The model that Spin would be given."""
    from m2pem.verify.net.simplify import simplify
    from m2pem.verify.spin.promela import text_of
    from m2pem.verify.translate import translate

    system = translate(asked.mission, asked.fleet, process=asked.process, options=asked.options)
    return text_of(simplify(system)).text


@contextmanager
def _ended_as_by_hand() -> Iterator[None]:
    """What else asks a program to end does what Ctrl-C does: what was seen is told, Spin ends."""
    before = {}
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:
            before[number] = signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def progress() -> "Iterator[Callable[[Progress], None] | None]":
    """A line on standard error that counts up, for a person who looks."""
    if not sys.stderr.isatty():
        yield None
        return
    shown_at = 0.0

    def show(searched: "Progress") -> None:
        nonlocal shown_at
        now = time.monotonic()
        if searched.seconds > _QUIET_S and now > shown_at + _BETWEEN_LINES_S:
            shown_at = now
            _write(f"\r\033[K{_line(searched)} (Ctrl-C to stop)")

    try:
        yield show
    finally:
        if shown_at:
            _write("\r\033[K")


def _line(searched: "Progress") -> str:
    said = [f"searching for {searched.seconds:.0f} s"]
    if searched.states:
        said.append(f"{searched.states:,} states found")
    if searched.waiting:
        said.append(f"{searched.waiting:,} of them to be searched")
    return ", ".join(said)


def _write(text: str) -> None:
    print(text, end="", file=sys.stderr, flush=True)
