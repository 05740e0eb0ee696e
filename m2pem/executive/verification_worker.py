"""The subprocess that verifies a mission for an executive."""

import logging
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from m2pem.api.arbiter import ArbiterContext
from m2pem.api.authoring import DEFAULT_LIMITS, MissionSource, SearchLimits, SearchProgress
from m2pem.api.clock import SystemClock
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.loading import load_source
from m2pem.executive.subprocess_worker import (
    EncodedSource,
    SendProgress,
    encode_source,
    run_in_subprocess,
    serve,
)
from m2pem.fleet.fleet import Fleet, dump, restore
from m2pem.mission.values import Value
from m2pem.telemetry.bus import Bus

TOKENS = 3
"""The most tokens on one place that the search follows, as in `m2pem verify`."""

_BETWEEN_S = 0.2
"""Seconds between two progress messages."""


class Order(msgspec.Struct):
    """What the subprocess verifies."""

    mission: EncodedSource
    fleet: bytes
    search_path: list[str]
    process: str | None
    data: dict[str, Any]
    spec: bytes | None
    strict: bool
    timers_in_order: bool
    limits: SearchLimits
    assume: list[str]
    all_pools: bool


async def verify_in_subprocess(
    mission: MissionSource,
    fleet: Fleet,
    *,
    search_path: Iterable[Path],
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    spec: str | None = None,
    strict: bool = False,
    timers_in_order: bool = False,
    assume: Sequence[str] = (),
    all_pools: bool = False,
    limits: SearchLimits = DEFAULT_LIMITS,
    on_progress: Callable[[SearchProgress], None] | None = None,
) -> dict[str, Any]:
    """Return the answers of `m2pem verify --format json`, computed in a subprocess."""
    order = Order(
        encode_source(mission),
        dump(fleet),
        [str(each) for each in search_path],
        process,
        dict(data or {}),
        None if spec is None else spec.encode(),
        strict,
        timers_in_order,
        limits,
        list(assume),
        all_pools,
    )

    def report_progress(content: bytes) -> None:
        if on_progress is not None:
            on_progress(msgspec.msgpack.decode(content, type=SearchProgress))

    answer = await run_in_subprocess(__name__, msgspec.msgpack.encode(order), report_progress)
    found: dict[str, Any] = msgspec.json.decode(answer)
    return found


def _work(content: bytes, send: SendProgress) -> bytes:
    # What searches is loaded here: the executive has no use for it.
    from m2pem.executive.verification import SearchEngine, search, search_request  # noqa: PLC0415
    from m2pem.plugins import PluginManager  # noqa: PLC0415
    from m2pem.verify.properties.results import Result  # noqa: PLC0415
    from m2pem.verify.report.data import as_data  # noqa: PLC0415
    from m2pem.verify.report.text import word_of  # noqa: PLC0415
    from m2pem.verify.search.explore import (  # noqa: PLC0415
        AFTER_VIOLATION_STATES,
        Limits,
        Progress,
    )

    order = msgspec.msgpack.decode(content, type=Order)
    shown_at = 0.0
    verdicts: dict[str, str] = {}

    def decided(result: Result) -> None:
        verdicts[result.property] = word_of(result, strict=order.strict)

    def progress(searched: Progress) -> None:
        nonlocal shown_at
        now = time.monotonic()
        if now >= shown_at + _BETWEEN_S:
            shown_at = now
            how_far = SearchProgress(
                searched.seconds,
                searched.states,
                searched.waiting,
                searched.memory_mb,
                verdicts,
            )
            send(msgspec.msgpack.encode(how_far))

    path = [Path(each) for each in order.search_path]
    loaded = load_source(order.mission.source_of(), path)
    plugins = PluginManager()
    asked = search_request(
        loaded,
        _arbiters(restore(order.fleet), plugins),
        plugins,
        order.process,
        order.data,
        order.spec,
        timers_in_order=order.timers_in_order,
        assume=order.assume,
        all_pools=order.all_pools,
    )
    limits = Limits(
        states=order.limits.states,
        seconds=order.limits.seconds,
        tokens=TOKENS,
        after_violation=None if order.limits.exhaustive else AFTER_VIOLATION_STATES,
    )
    found = search(
        asked,
        SearchEngine("builtin", "exact", limits),
        strict=order.strict,
        progress=progress,
        decided=decided,
    )
    return msgspec.json.encode(as_data(found))


def _arbiters(fleet: Fleet, plugins: Any) -> FleetArbiters:
    """Make the arbiters of a fleet to read their catalogues; they are not connected."""
    context = ArbiterContext(
        SystemClock(),
        Bus(),
        logging.getLogger("m2pem.arbiter"),
        fleet.origin,
        {team.name: team.members for team in fleet.teams.values()},
    )
    return FleetArbiters(fleet, plugins, context)


if __name__ == "__main__":
    serve(_work)
