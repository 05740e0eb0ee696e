"""What may be asked through the socket: methods of MissionControl, with their parameters."""

from base64 import b64encode
from collections.abc import Awaitable, Callable
from typing import Any, TypeAlias

import msgspec

from m2pem.api.control import MissionControl
from m2pem.fleet.fleet import dump
from m2pem.mission.values import Value


class Params(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all parameters; `by` names who asks."""


class Nothing(Params, frozen=True):
    """No parameters."""


class OfRun(Params, frozen=True):
    """A run, and who asks."""

    run: str
    by: str = ""


class Stop(OfRun, frozen=True):
    """As MissionControl.stop."""

    reason: str = ""


class StopAll(Params, frozen=True):
    """As MissionControl.stop_all."""

    by: str = ""
    reason: str = ""


class Answer(Params, frozen=True):
    """As MissionControl.answer."""

    run: str
    prompt: str
    decision: str
    by: str = ""


class Signal(Params, frozen=True):
    """As MissionControl.signal and MissionControl.message; `id` is that of the root element."""

    id: str
    run: str | None = None
    data: dict[str, Value] = msgspec.field(default_factory=dict)
    by: str = ""


class Geometry(Params, frozen=True):
    """As MissionControl.set_geometry."""

    name: str
    geometry: dict[str, Value]
    run: str | None = None
    by: str = ""


class Resource(Params, frozen=True):
    """As MissionControl.take and MissionControl.give_back."""

    resource: str
    by: str = ""


class Preview(Params, frozen=True):
    """As MissionControl.preview_take."""

    resource: str


class Page(Params, frozen=True):
    """As MissionControl.records."""

    run: str
    after_seq: int = 0
    limit: int = 1000


Method: TypeAlias = tuple[type[Params], Callable[[MissionControl, Any], Awaitable[Any]]]


async def _runs(control: MissionControl, _: Nothing) -> Any:
    return await control.runs()


async def _prompts(control: MissionControl, _: Nothing) -> Any:
    return control.prompts()


async def _fleet(control: MissionControl, _: Nothing) -> Any:
    return b64encode(dump(control.fleet())).decode()


async def _catalogue(control: MissionControl, _: Nothing) -> Any:
    return control.catalogue()


async def _simulated(control: MissionControl, _: Nothing) -> Any:
    return control.simulated()


async def _speed(control: MissionControl, _: Nothing) -> Any:
    return control.speed()


async def _journal_file(control: MissionControl, _: Nothing) -> Any:
    path = control.journal_file()
    return None if path is None else str(path)


async def _mission(control: MissionControl, p: OfRun) -> Any:
    mission = await control.mission(p.run)
    return {"file": mission.file, "source": mission.source, "library": mission.library}


METHODS: dict[str, Method] = {
    "answer": (Answer, lambda c, p: c.answer(p.run, p.prompt, p.decision, by=p.by)),
    "signal": (Signal, lambda c, p: c.signal(p.id, run=p.run, data=p.data, by=p.by)),
    "message": (Signal, lambda c, p: c.message(p.id, run=p.run, data=p.data, by=p.by)),
    "stop": (Stop, lambda c, p: c.stop(p.run, by=p.by, reason=p.reason)),
    "stop_all": (StopAll, lambda c, p: c.stop_all(by=p.by, reason=p.reason)),
    "pause": (OfRun, lambda c, p: c.pause(p.run, by=p.by)),
    "resume": (OfRun, lambda c, p: c.resume(p.run, by=p.by)),
    "set_geometry": (Geometry, lambda c, p: c.set_geometry(p.name, p.geometry, run=p.run, by=p.by)),
    "take": (Resource, lambda c, p: c.take(p.resource, by=p.by)),
    "preview_take": (Preview, lambda c, p: c.preview_take(p.resource)),
    "give_back": (Resource, lambda c, p: c.give_back(p.resource, by=p.by)),
    "holders": (Nothing, lambda c, _: c.holders()),
    "runs": (Nothing, _runs),
    "prompts": (Nothing, _prompts),
    "records": (Page, lambda c, p: c.records(p.run, p.after_seq, p.limit)),
    "mission": (OfRun, _mission),
    "mission_time_s": (OfRun, lambda c, p: c.mission_time_s(p.run)),
    "wait": (OfRun, lambda c, p: c.wait(p.run)),
    "fleet": (Nothing, _fleet),
    "catalogue": (Nothing, _catalogue),
    "simulated": (Nothing, _simulated),
    "speed": (Nothing, _speed),
    "journal_file": (Nothing, _journal_file),
}
"""Calls, answered once."""


class Subscribe(Params, frozen=True):
    """As MissionControl.subscribe."""

    run: str | None = None
    size: int = 10_000


class Telemetry(Params, frozen=True):
    """As MissionControl.telemetry."""

    size: int = 100


STREAMS: dict[str, tuple[type[Params], Callable[[MissionControl, Any], Any]]] = {
    "subscribe": (Subscribe, lambda c, p: c.subscribe(p.run, p.size)),
    "telemetry": (Telemetry, lambda c, p: c.telemetry(p.size)),
}
"""Calls answered with null, then with notifications of the same name until the caller hangs up."""
