"""Plans of ground stations in files: QGroundControl's `.plan`, and "QGC WPL 110" of all others."""

import hashlib
import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mavlink_plan_upload import Item

FRAME_MISSION = 2


@dataclass(frozen=True)
class PublicPlan:
    """`kind`: of the vehicle, by its folder, or the format."""

    path: Path
    kind: str
    items: Sequence[Item]

    @property
    def name(self) -> str:
        return "/".join(self.path.parts[-2:])

    @property
    def places(self) -> list[tuple[int, tuple[float, float]]]:
        """The items that have a place, with it."""
        return [
            (number, (each.x / 1e7, each.y / 1e7))
            for number, each in enumerate(self.items)
            if each.frame != FRAME_MISSION and each.x and each.y and each.command < 100
        ]


def public_plans(folder: Path) -> list[PublicPlan]:
    """Return all missions below a folder; of files with the same items, the first."""
    found: dict[str, PublicPlan] = {}
    files = [Path(at, each) for at, _, names in os.walk(folder, followlinks=True) for each in names]
    for path in sorted(files):
        if path.suffix not in (".plan", ".waypoints", ".txt"):
            continue
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        items = list(_of_plan(text) if path.suffix == ".plan" else _of_lines(text))
        if items:
            content = repr([each.fields(0) for each in items])
            digest = hashlib.sha256(content.encode()).hexdigest()
            found.setdefault(digest, PublicPlan(path, _kind(path), items))
    return list(found.values())


def _kind(path: Path) -> str:
    if path.suffix == ".plan":
        return "plan"
    for name in ("Copter", "Plane", "Rover", "Sub"):
        if f"Ardu{name}" in str(path):
            return name
    return "other"


def _of_lines(text: str) -> Iterator[Item]:
    """Yield the items of a file of lines, without item 0, which is the home position."""
    head, *lines = text.splitlines() or [""]
    if not head.startswith("QGC WPL"):
        return
    for line in lines[1:]:
        fields = line.split()
        if len(fields) == 12 and not line.startswith("#"):
            frame, command = int(float(fields[2])), int(float(fields[3]))
            numbers = [float(each) for each in fields[4:11]]
            yield Item(command, numbers[4:], numbers[:4], frame)


def _of_plan(text: str) -> Iterator[Item]:
    yield from _items(json.loads(text).get("mission", {}).get("items", ()))


def _items(items: Sequence[dict[str, Any]]) -> Iterator[Item]:
    for item in items:
        if item["type"] == "SimpleItem":
            numbers = [math.nan if each is None else float(each) for each in item["params"]]
            place = [0.0 if math.isnan(each) else each for each in numbers[4:]]
            yield Item(item["command"], place, numbers[:4], item["frame"])
        else:
            inner = item.get("TransectStyleComplexItem", item)
            yield from _items(inner.get("Items", ()))
