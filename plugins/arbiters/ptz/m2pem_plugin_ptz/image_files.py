"""Files of pictures, each with a JSON file of its metadata beside it.

A file is written whole or not at all, and never replaces another.
"""

import errno
import io
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
from m2pem_plugin_ptz.camera_model.model import CameraModel, iso
from m2pem_plugin_ptz.gimbal import CapturedImage, PanTiltZoom

_NO_LINKS = (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EACCES)


def decode(content: bytes) -> None:
    """Decode a JPEG or PNG, as a check. Blocking.

    Raises:
        Exception: it cannot be decoded, or not to its end; each format of Pillow raises its own.
    """
    from PIL import Image  # noqa: PLC0415  # comes with the extras of drivers that fetch pictures

    with Image.open(io.BytesIO(content), formats=("JPEG", "PNG")) as picture:
        picture.load()


@dataclass(frozen=True, slots=True)
class ImageMetadata:
    """The metadata of a picture. `position`: of the camera: [latitude, longitude, altitude].

    `number`: of the behavior's pictures, from 1. `time_us`: microseconds since the Unix epoch.
    """

    behavior: BehaviorId
    number: int
    time_us: int
    position: Value
    facts: Mapping[str, Any]

    @classmethod
    def of(cls, model: CameraModel, behavior: BehaviorId, number: int) -> "ImageMetadata":
        """Return the metadata for the current pose of a camera."""
        now_us, ptz = model.now_us, model.driver.ptz
        camera_pose = model.camera_pose(now_us)
        where = camera_pose.position if camera_pose is not None else None
        facts = {
            "camera": model.resource,
            "run": behavior.rpartition(".")[0],
            "behavior": behavior,
            "number": number,
            "journal": str(model.context.journal),
            "position": _position(where),
            "vehicle": _vehicle(model, now_us),
            "look": _pointing_facts(model, now_us, ptz),
            "footprint": [_position(corner) for corner in model.footprint(ptz)],
        }
        return cls(behavior, number, now_us, _position(where), facts)

    def taken(self, picture: CapturedImage) -> "ImageMetadata":
        """Return the metadata with the time that the camera reports."""
        return replace(self, time_us=picture.taken_us)


def store_image(folder: Path, picture: CapturedImage, metadata: ImageMetadata) -> str:
    """Store a picture. Return the absolute name of its file, or the reference of a picture that the
    camera keeps.

    Raises:
        OSError: the file cannot be written.
    """
    run, _, name = metadata.behavior.rpartition(".")
    place = folder.absolute() / _safe_name(run or "run")
    place.mkdir(parents=True, exist_ok=True)
    number = metadata.number
    while True:
        stem = place / f"{_safe_name(name)}_{number}"
        notes, file = stem.with_suffix(".json"), stem.with_suffix(_suffix(picture))
        number += 1
        if file.exists():
            continue
        stored = picture.reference if picture.content is None else str(file)
        if not _write_whole(notes, _metadata(metadata, picture, stored)):
            continue
        try:
            if picture.content is None or _write_whole(file, picture.content):
                return stored
        except BaseException:
            notes.unlink(missing_ok=True)
            raise
        notes.unlink(missing_ok=True)


def _metadata(metadata: ImageMetadata, picture: CapturedImage, file: str) -> bytes:
    whole = {
        "file": file,
        "reference": picture.reference or None,
        "time": iso(metadata.time_us),
        **metadata.facts,
    }
    return json.dumps(whole, indent=2, ensure_ascii=False).encode()


def _write_whole(path: Path, content: bytes) -> bool:
    """Write a file as a whole. Return False if the name exists."""
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
            if path.exists():  # FAT has no links; no other program writes these names
                return False
            Path(temporary).replace(path)
    finally:
        Path(temporary).unlink(missing_ok=True)
    return True


def _safe_name(name: str) -> str:
    """Return a name without path separators."""
    return re.sub(r"[^\w-]", "_", name)


def _suffix(picture: CapturedImage) -> str:
    return picture.suffix if re.fullmatch(r"\.\w{1,8}", picture.suffix) else ".jpg"


def _position(position: GeoPosition | None) -> Value:
    if position is None:
        return None
    return [position.latitude_deg, position.longitude_deg, position.altitude_m]


def _vehicle(model: CameraModel, now_us: int) -> Mapping[str, Any]:
    roll, pitch, yaw = model.vehicle_pose.attitude(now_us)
    state = model.vehicle_pose.state()
    return {
        "name": model.vehicle_pose.vehicle,
        "position": _position(state.position if state is not None else None),
        "roll_deg": math.degrees(roll),
        "pitch_deg": math.degrees(pitch),
        "heading_deg": None if yaw is None else math.degrees(math.pi / 2 - yaw) % 360,
    }


def _pointing_facts(
    model: CameraModel, now_us: int, ptz: PanTiltZoom | None
) -> Mapping[str, Any] | None:
    if ptz is None:
        return None
    heading, elevation = model.mount_frame(now_us).heading(ptz.pan_rad, ptz.tilt_rad)
    known = model.vehicle_pose.attitude(now_us)[2] is not None
    view = model.field_of_view(ptz)
    return {
        "pan_deg": math.degrees(ptz.pan_rad),
        "tilt_deg": math.degrees(ptz.tilt_rad),
        "zoom": ptz.zoom,
        "heading_deg": math.degrees(heading) % 360 if known else None,
        "elevation_deg": math.degrees(elevation),
        "view_deg": [math.degrees(view.width_rad), math.degrees(view.height_rad)],
    }
