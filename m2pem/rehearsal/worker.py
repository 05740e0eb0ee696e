"""The process of its own in which a mission is rehearsed for an executive."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from m2pem.api.authoring import MissionSource
from m2pem.api.runs import SimulationResult
from m2pem.errors import OperatorError
from m2pem.executive.subprocess_worker import (
    EncodedSource,
    SendProgress,
    encode_source,
    run_in_subprocess,
    serve,
)
from m2pem.fleet.fleet import Fleet, dump, restore
from m2pem.mission.values import Value

MAX_STEPS = 100_000
"""Engine steps after which a rehearsal beside live missions is given up, unless said otherwise."""


class Order(msgspec.Struct):
    """A rehearsal, as the worker receives it. `options`: those of `rehearse`."""

    mission: EncodedSource
    fleet: bytes
    search_path: list[str]
    options: dict[str, Any]


async def rehearse_in_subprocess(
    mission: MissionSource,
    fleet: Fleet,
    *,
    search_path: Sequence[Path],
    max_steps: int = MAX_STEPS,
    process: str | None = None,
    data: Mapping[str, Value] | None = None,
    spec: bytes | None = None,
    answers: Path | str | bytes | None = None,
    start_us: int | None = None,
    telemetry_every_s: float | None = None,
) -> SimulationResult:
    """As `m2pem.rehearsal.rehearsal.rehearse`, without observers; cancelling ends the process.

    Raises:
        FindingsError: the mission, the requirements or the answers cannot be used.
        OperatorError: an option has no sense.
    """
    if max_steps < 1 or (telemetry_every_s is not None and not telemetry_every_s > 0):
        raise OperatorError("max_steps and telemetry_every_s are greater than 0")
    options = {
        "process": process,
        "data": dict(data or {}),
        "spec": spec,
        "answers": str(answers) if isinstance(answers, Path) else answers,
        "max_steps": max_steps,
        "telemetry_every_s": telemetry_every_s,
        **({} if start_us is None else {"start_us": start_us}),
    }
    folders = [str(each) for each in search_path]
    order = Order(encode_source(mission), dump(fleet), folders, options)
    answer = await run_in_subprocess(__name__, msgspec.msgpack.encode(order))
    return msgspec.msgpack.decode(answer, type=SimulationResult)


def _work(content: bytes, _: SendProgress) -> bytes:
    from m2pem.plugins import PluginManager  # noqa: PLC0415  # the executive has its own
    from m2pem.rehearsal.rehearsal import rehearse  # noqa: PLC0415

    order = msgspec.msgpack.decode(content, type=Order)
    result = rehearse(
        order.mission.source_of(),
        restore(order.fleet),
        plugins=PluginManager(),
        observed=False,
        search_path=[Path(each) for each in order.search_path],
        **order.options,
    )
    return msgspec.msgpack.encode(result)


if __name__ == "__main__":
    serve(_work)
