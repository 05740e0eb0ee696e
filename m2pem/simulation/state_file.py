"""What the simulation keeps of behaviors and effects: bounded in memory, or in a file."""

import json
import os
import sqlite3
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from m2pem.api.arbiter import BehaviorId, BehaviorReport
from m2pem.api.remaining import restored_work
from m2pem.errors import M2pemError
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.catalogue import ResourceId
from m2pem.simulation.executions import (
    Aim,
    Body,
    Effect,
    EffectKind,
    Execution,
    Outcome,
    Part,
    Strike,
)
from m2pem.simulation.gimbals import Shots
from m2pem.simulation.pursuit import Pursuit
from m2pem.simulation.segments import PayloadPhase, VehiclePhase
from m2pem.simulation.trajectory import Plan, Track, Warp
from m2pem.simulation.vehicles import SimVehicle

FORMAT = "1"
REMEMBERED = 10_000
"""So many behaviors that ended are kept."""

REMEMBERED_EPOCHS = 1_000

_SCHEMA = """
CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS bodies (resource TEXT PRIMARY KEY, state BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS behaviors (
    number INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE, ended INTEGER NOT NULL, state BLOB NOT NULL
);
CREATE TABLE IF NOT EXISTS effects (
    number INTEGER PRIMARY KEY, time_us INTEGER NOT NULL, kind TEXT NOT NULL,
    resource TEXT NOT NULL, behavior TEXT NOT NULL
);
"""


class StateFileError(M2pemError):
    """The state file of a simulation cannot be used."""

    exit_status = 2


class _Body(msgspec.Struct, kw_only=True):
    cycle_from: int | None
    started_us: int
    warp: Warp
    behavior: str
    doing: str
    held: bool


class _Vehicle(_Body, kw_only=True):
    phases: list[VehiclePhase]
    counted_us: int
    battery: float
    cruise_m_s: float


class _Payload(_Body, kw_only=True):
    phases: list[PayloadPhase]


class _Part(msgspec.Struct):
    resource: str
    pursuit: Pursuit | None
    aim: Aim | None
    idle: bool
    chasing: bool
    done: bool
    work: dict[str, Any] | None = None


class _Behavior(msgspec.Struct):
    id: str
    epoch: int
    behavior: str
    resources: list[str]
    watch: Warp
    parts: list[_Part]
    strike: Strike | None
    limit_s: float | None
    number: int
    last: BehaviorReport | None
    outcome: Outcome | None
    deaf: bool
    cancelling: bool
    shots: Shots | None = None


_AS_THEY_ARE = (
    *("epoch", "behavior", "watch", "strike", "limit_s", "number", "last", "outcome"),
    *("deaf", "cancelling", "shots"),
)
"""What the file has of a behavior as the simulation has it."""


def _make_private(path: str) -> None:
    """Make a new file readable by its owner alone: it says where vehicles are. SQLite gives its
    log the same mode."""
    with suppress(FileExistsError):
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600))


class StateFile:
    """One file; several resources may share it, one arbiter at a time may write it.

    `journal`: of the executive. Ids of behaviors are unique within a journal alone, so the file
    stores them with its name in front. Those of other journals are read with that name.
    """

    def __init__(self, path: str, journal: str = "") -> None:
        self.path = path
        self._prefix = f"{journal}/" if journal else ""
        try:
            _make_private(path)
            self._connection = sqlite3.connect(path, isolation_level=None)
            self._connection.execute("PRAGMA journal_mode=WAL")
            self._connection.execute("PRAGMA synchronous=NORMAL")
            self._connection.executescript(_SCHEMA)
            found = self.meta("format", FORMAT)
        except (sqlite3.Error, OSError) as error:
            raise StateFileError(
                f"{path}: cannot keep the state of a simulation here: {error}; name a file in a "
                "folder that exists, or remove the file to start again"
            ) from error
        if found != FORMAT:
            raise StateFileError(f"{path}: is of format {found}, not {FORMAT}; remove it")

    def close(self) -> None:
        self._connection.close()

    def meta(self, key: str, default: str) -> str:
        """The value kept under `key`; the first time, `default` is kept."""
        self._connection.execute("INSERT OR IGNORE INTO meta VALUES (?, ?)", (key, default))
        row = self._connection.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        return str(row[0])

    def set_meta(self, key: str, value: str) -> None:
        self._connection.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, value))

    def epochs(self) -> dict[str, int]:
        """The highest epochs that were kept, by run of this journal."""
        return dict(json.loads(self.meta(self._epochs_key, "{}")))

    def keep_epoch(self, run: str, epoch: int) -> None:
        """Keep the highest epoch of a run; those kept longest ago are forgotten."""
        kept = self.epochs()
        kept.pop(run, None)
        kept[run] = epoch
        newest = dict(list(kept.items())[-REMEMBERED_EPOCHS:])
        self.set_meta(self._epochs_key, json.dumps(newest))

    @property
    def _epochs_key(self) -> str:
        return f"epochs {self._prefix}"

    def save(
        self, bodies: Iterable[Body], execution: Execution | None, effects: Iterable[Effect]
    ) -> None:
        """Keep what has changed, all or nothing."""
        run = self._connection.execute
        run("BEGIN IMMEDIATE")
        try:
            for body in bodies:
                kept = _body_record(body)
                kept.behavior = self._kept(kept.behavior)
                row = (body.id, msgspec.msgpack.encode(kept))
                run("INSERT OR REPLACE INTO bodies VALUES (?, ?)", row)
            if execution is not None:
                record = _behavior_record(execution)
                record.id = self._kept(record.id)
                data = msgspec.msgpack.encode(record)
                run(
                    "INSERT INTO behaviors (id, ended, state) VALUES (?, ?, ?) "
                    "ON CONFLICT (id) DO UPDATE SET ended = excluded.ended, state = excluded.state",
                    (record.id, execution.ended, data),
                )
                run(
                    "DELETE FROM behaviors WHERE ended AND number <= "
                    "(SELECT MAX(number) FROM behaviors) - ?",
                    (REMEMBERED,),
                )
            for effect in effects:
                run(
                    "INSERT INTO effects (time_us, kind, resource, behavior) VALUES (?, ?, ?, ?)",
                    (effect.time_us, effect.kind.value, effect.resource, effect.behavior),
                )
            run("COMMIT")
        except BaseException:
            if self._connection.in_transaction:  # on a full disk SQLite itself has rolled back
                run("ROLLBACK")
            raise

    def load_bodies(self, bodies: dict[ResourceId, Body]) -> None:
        """Put the bodies that the file knows where they were."""
        for resource, data in self._connection.execute("SELECT resource, state FROM bodies"):
            body = bodies.get(ResourceId(resource))
            if body is None:
                continue
            kept = self._decode(data, _Vehicle if isinstance(body, SimVehicle) else _Payload)
            body.behavior, body.doing, body.held = self._read(kept.behavior), kept.doing, kept.held
            plan, counted_us = Plan(kept.phases, kept.cycle_from), getattr(kept, "counted_us", None)
            body.track = Track(plan, kept.started_us, kept.warp, counted_us)
            if isinstance(body, SimVehicle):
                body.battery, body.cruise_m_s = kept.battery, kept.cruise_m_s

    def load_behaviors(self, bodies: dict[ResourceId, Body], frame: LocalFrame) -> list[Execution]:
        """The behaviors that are remembered, in the order of their first start."""
        rows = self._connection.execute("SELECT state FROM behaviors ORDER BY number")
        records = [self._decode(data, _Behavior) for (data,) in rows]
        for record in records:
            record.id = self._read(record.id)
            if record.last is not None:  # another journal's executive may have kept it
                record.last = replace(record.last, id=BehaviorId(record.id))
        return [_execution(record, bodies, frame) for record in records]

    def _kept(self, behavior: str) -> str:
        return behavior if not behavior or "/" in behavior else self._prefix + behavior

    def _read(self, behavior: str) -> str:
        return behavior.removeprefix(self._prefix)

    def _decode(self, data: bytes, type_: type[Any]) -> Any:
        try:
            return msgspec.msgpack.decode(data, type=type_)
        except msgspec.MsgspecError as error:
            raise StateFileError(
                f"{self.path}: was written by another version ({error}); remove it to start again"
            ) from error


def recorded_effects(path: str | Path) -> Sequence[Effect]:
    """Every effect that a state file knows of, in order."""
    connection = sqlite3.connect(f"file:{Path(path)}?mode=ro", uri=True)
    try:
        rows = connection.execute(
            "SELECT time_us, kind, resource, behavior FROM effects ORDER BY number"
        ).fetchall()
    finally:
        connection.close()
    return [
        Effect(time_us, EffectKind(kind), ResourceId(resource), behavior)
        for time_us, kind, resource, behavior in rows
    ]


def _body_record(body: Body) -> _Vehicle | _Payload:
    track = body.track
    kept: dict[str, Any] = {
        **{name: getattr(body, name) for name in ("behavior", "doing", "held")},
        **{"phases": list(track.plan.phases), "cycle_from": track.plan.cycle_from},
        **{"started_us": track.started_us, "warp": track.warp},
    }
    if not isinstance(body, SimVehicle):
        return _Payload(**kept)
    counted_us, battery, cruise_m_s = track.counted_us, body.battery, body.cruise_m_s
    return _Vehicle(**kept, counted_us=counted_us, battery=battery, cruise_m_s=cruise_m_s)


def _behavior_record(execution: Execution) -> _Behavior:
    return _Behavior(
        id=execution.id,
        resources=list(execution.resources),
        parts=[
            _Part(
                part.body.id,
                part.chase if isinstance(part.chase, Pursuit) else None,
                part.chase if isinstance(part.chase, Aim) else None,
                part.idle,
                part.chasing,
                part.done,
                part.work.state() if part.work is not None else None,
            )
            for part in execution.parts
        ],
        **{name: getattr(execution, name) for name in _AS_THEY_ARE},
    )


def _execution(record: _Behavior, bodies: dict[ResourceId, Body], frame: LocalFrame) -> Execution:
    return Execution(
        id=BehaviorId(record.id),
        resources=tuple(ResourceId(resource) for resource in record.resources),
        parts=[
            Part(
                bodies[ResourceId(part.resource)],
                part.pursuit or part.aim,
                idle=part.idle,
                chasing=part.chasing,
                done=part.done,
                work=restored_work(part.work, frame) if part.work is not None else None,
            )
            for part in record.parts
            if ResourceId(part.resource) in bodies
        ],
        **{name: getattr(record, name) for name in _AS_THEY_ARE},
    )


REMEMBERED_EFFECTS = 10_000


class Memory:
    """`files`: where the state of each resource is kept; those that are missing die with us."""

    def __init__(self) -> None:
        self.effects: deque[Effect] = deque(maxlen=REMEMBERED_EFFECTS)
        self.executions: dict[BehaviorId, Execution] = {}
        self.files: Mapping[ResourceId, StateFile] = {}
        self._unsaved: list[Effect] = []

    def register(self, execution: Execution) -> None:
        """Know a behavior from now on, as the newest."""
        self.executions.pop(execution.id, None)
        self.executions[execution.id] = execution
        if len(self.executions) > REMEMBERED:
            ended = (key for key, kept in self.executions.items() if kept.ended)
            oldest = next(ended, None)
            if oldest is not None:
                del self.executions[oldest]

    def note(self, effect: Effect) -> None:
        self.effects.append(effect)
        self._unsaved.append(effect)

    def note_of(self, execution: Execution, kind: EffectKind, now_us: int) -> None:
        self.note(Effect(now_us, kind, execution.resources[0], execution.id))

    def save(self, execution: Execution | None, *bodies: Body) -> None:
        """Keep a behavior, its bodies and more, with the effects noted since."""
        effects, self._unsaved = self._unsaved, []
        if not self.files:
            return
        parts = execution.parts if execution is not None else []
        all_bodies = {body.id: body for body in (*(part.body for part in parts), *bodies)}
        home = None
        if execution is not None and execution.resources:
            home = self.files.get(execution.resources[0])
        for file in dict.fromkeys(self.files.values()):
            changed = [body for body in all_bodies.values() if self.files.get(body.id) is file]
            noted = [effect for effect in effects if self.files.get(effect.resource) is file]
            kept = execution if file is home else None
            if changed or noted or kept:
                file.save(changed, kept, noted)
