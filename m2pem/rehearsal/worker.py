"""The process of its own in which a mission is rehearsed for an executive."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from m2pem.api.authoring import MissionSource
from m2pem.api.requirement_states import RequirementState
from m2pem.api.runs import RunSummary, SimulationResult, StampedRecord, TelemetrySample
from m2pem.errors import OperatorError
from m2pem.executive.subprocess_worker import (
    EncodedSource,
    SendProgress,
    encode_source,
    run_in_subprocess,
    serve,
)
from m2pem.fleet.fleet import Fleet, dump, restore
from m2pem.mission.library import MissionFile
from m2pem.mission.values import Value

MAX_STEPS = 100_000
"""Engine steps after which a rehearsal beside live missions is given up, unless said otherwise."""


class Order(msgspec.Struct):
    """The arguments of a rehearsal, as the worker receives them."""

    mission: EncodedSource
    fleet: bytes
    process: str | None
    data: dict[str, Any]
    spec: bytes | None
    answers: str | None
    answers_text: bytes | None
    start_us: int | None
    max_steps: int
    search_path: list[str]
    telemetry_every_s: float | None


class Done(msgspec.Struct):
    """The result of a rehearsal, as the worker returns it."""

    summary: RunSummary
    records: list[StampedRecord]
    telemetry: list[TelemetrySample]
    files: list[MissionFile]
    requirements: list[RequirementState]


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
    order = Order(
        encode_source(mission),
        dump(fleet),
        process,
        dict(data or {}),
        spec,
        None if answers is None or isinstance(answers, bytes) else str(answers),
        answers if isinstance(answers, bytes) else None,
        start_us,
        max_steps,
        [str(each) for each in search_path],
        telemetry_every_s,
    )
    answer = await run_in_subprocess(__name__, msgspec.msgpack.encode(order))
    done = msgspec.msgpack.decode(answer, type=Done)
    return SimulationResult(
        done.summary,
        tuple(done.records),
        tuple(done.telemetry),
        tuple(done.files),
        tuple(done.requirements),
    )


def _work(content: bytes, _: SendProgress) -> bytes:
    from m2pem.plugins import PluginManager  # noqa: PLC0415  # the executive has its own
    from m2pem.rehearsal.rehearsal import START_US, rehearse  # noqa: PLC0415

    order = msgspec.msgpack.decode(content, type=Order)
    result = rehearse(
        order.mission.source_of(),
        restore(order.fleet),
        plugins=PluginManager(),
        process=order.process,
        data=order.data,
        spec=order.spec,
        answers=order.answers if order.answers_text is None else order.answers_text,
        start_us=START_US if order.start_us is None else order.start_us,
        max_steps=order.max_steps,
        observed=False,
        search_path=[Path(each) for each in order.search_path],
        telemetry_every_s=order.telemetry_every_s,
    )
    done = Done(
        result.summary,
        list(result.records),
        list(result.telemetry),
        list(result.files),
        list(result.requirements),
    )
    return msgspec.msgpack.encode(done)


if __name__ == "__main__":
    serve(_work)
