"""Pictures in files, each with what is known of it in a file of JSON beside it.

A picture is whole or not there, and none takes the place of another, whatever was stored before.
"""

import errno
import json
import math
import os
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from m2pem.api import BehaviorId, GeoPosition, Value
from m2pem_plugin_ptz.camera_model.model import Sight, iso
from m2pem_plugin_ptz.gimbal import Look, Picture

_NO_LINKS = (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EACCES)


@dataclass(frozen=True, slots=True)
class Caption:
    """What is known of a picture. `position`: of the camera: [latitude, longitude, altitude].

    `number`: of the behavior's pictures, from 1. `time_us`: microseconds since the Unix epoch.
    """

    behavior: BehaviorId
    number: int
    time_us: int
    position: Value
    facts: Mapping[str, Any]

    @classmethod
    def of(cls, sight: Sight, behavior: BehaviorId, number: int) -> "Caption":
        """As a camera looks now."""
        now_us, look = sight.now_us, sight.driver.look
        eye = sight.eye(now_us)
        where = eye.position if eye is not None else None
        facts = {
            "camera": sight.resource,
            "run": behavior.rpartition(".")[0],
            "behavior": behavior,
            "number": number,
            "journal": str(sight.context.journal),
            "position": _position(where),
            "vehicle": _vehicle(sight, now_us),
            "look": _look(sight, now_us, look),
            "footprint": [_position(corner) for corner in sight.footprint(look)],
        }
        return cls(behavior, number, now_us, _position(where), facts)

    def taken(self, picture: Picture) -> "Caption":
        """With when it was taken, as the camera says."""
        return replace(self, time_us=picture.taken_us)


def stored(folder: Path, picture: Picture, caption: Caption) -> str:
    """Store a picture; returns the absolute name of its file, or what the camera calls it, which
    has kept it.

    Raises:
        OSError: it cannot be stored.
    """
    run, _, name = caption.behavior.rpartition(".")
    place = folder.absolute() / _plain(run or "run")
    place.mkdir(parents=True, exist_ok=True)
    number = caption.number
    while True:
        stem = place / f"{_plain(name)}_{number}"
        notes, file = stem.with_suffix(".json"), stem.with_suffix(_suffix(picture))
        number += 1
        if file.exists():
            continue
        said = picture.reference if picture.content is None else str(file)
        if not _written(notes, _notes(caption, picture, said)):
            continue
        try:
            if picture.content is None or _written(file, picture.content):
                return said
        except BaseException:
            notes.unlink(missing_ok=True)
            raise
        notes.unlink(missing_ok=True)


def _notes(caption: Caption, picture: Picture, file: str) -> bytes:
    whole = {
        "file": file,
        "reference": picture.reference or None,
        "time": iso(caption.time_us),
        **caption.facts,
    }
    return json.dumps(whole, indent=2, ensure_ascii=False).encode()


def _written(path: Path, content: bytes) -> bool:
    """Write a file as a whole; False: there is one of that name."""
    handle, temporary = tempfile.mkstemp(prefix=".", suffix=".part", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(0o644)
        try:
            os.link(temporary, path)
        except FileExistsError:
            return False
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            if path.exists():  # a card of FAT knows no links; nobody else writes these names
                return False
            Path(temporary).replace(path)
    finally:
        Path(temporary).unlink(missing_ok=True)
    return True


def _plain(name: str) -> str:
    """A name that can lead nowhere else."""
    return re.sub(r"[^\w-]", "_", name)


def _suffix(picture: Picture) -> str:
    return picture.suffix if re.fullmatch(r"\.\w{1,8}", picture.suffix) else ".jpg"


def _position(position: GeoPosition | None) -> Value:
    if position is None:
        return None
    return [position.latitude_deg, position.longitude_deg, position.altitude_m]


def _vehicle(sight: Sight, now_us: int) -> Mapping[str, Any]:
    roll, pitch, yaw = sight.carrier.turned(now_us)
    state = sight.carrier.state()
    return {
        "name": sight.carrier.vehicle,
        "position": _position(state.position if state is not None else None),
        "roll_deg": math.degrees(roll),
        "pitch_deg": math.degrees(pitch),
        "heading_deg": None if yaw is None else math.degrees(math.pi / 2 - yaw) % 360,
    }


def _look(sight: Sight, now_us: int, look: Look | None) -> Mapping[str, Any] | None:
    if look is None:
        return None
    heading, elevation = sight.deck(now_us).heading(look.pan_rad, look.tilt_rad)
    known = sight.carrier.turned(now_us)[2] is not None
    view = sight.view(look)
    return {
        "pan_deg": math.degrees(look.pan_rad),
        "tilt_deg": math.degrees(look.tilt_rad),
        "zoom": look.zoom,
        "heading_deg": math.degrees(heading) % 360 if known else None,
        "elevation_deg": math.degrees(elevation),
        "view_deg": [math.degrees(view.width_rad), math.degrees(view.height_rad)],
    }
