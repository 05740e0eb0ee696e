"""Vehicles that answer anything at all: no exchange breaks, hangs, floods or grows."""

import random
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from m2pem_plugin_mavlink.microservices.camera import FindCamera, ReadCaptureStatus
from m2pem_plugin_mavlink.microservices.camera_images import ReadImage
from m2pem_plugin_mavlink.microservices.commands import Command
from m2pem_plugin_mavlink.microservices.gimbal import FindGimbal
from m2pem_plugin_mavlink.microservices.gimbal_status import WANTED, GimbalStatus
from m2pem_plugin_mavlink.microservices.message_requests import RequestMessage, SetMessageInterval
from m2pem_plugin_mavlink.microservices.mission_download import DownloadMission
from m2pem_plugin_mavlink.microservices.mission_items import MissionItem
from m2pem_plugin_mavlink.microservices.mission_upload import UploadMission
from m2pem_plugin_mavlink.microservices.missions import (
    ClearMission,
    ReadMissionItem,
    SetCurrentItem,
)
from m2pem_plugin_mavlink.microservices.parameters import ParameterEncoding, ReadParameter
from m2pem_plugin_mavlink.protocol.messages import Message, message_type, types_by_id
from m2pem_plugin_mavlink.protocol.transaction import Transaction
from mavlink_lossy import VEHICLE, Silent, run
from pymavlink.dialects.v20 import ardupilotmega as dialect

ITEMS = (MissionItem(dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_FRAME_GLOBAL_INT),) * 4
BYTEWISE = ParameterEncoding.BYTEWISE
EXCHANGES: dict[str, Callable[[], Transaction[Any]]] = {
    "command": lambda: Command(VEHICLE, 400),
    "interval": lambda: SetMessageInterval(VEHICLE, 30, 0.01),
    "upload": lambda: UploadMission(VEHICLE, ITEMS),
    "download": lambda: DownloadMission(VEHICLE),
    "clear": lambda: ClearMission(VEHICLE),
    "current": lambda: SetCurrentItem(VEHICLE, 1),
    "item": lambda: ReadMissionItem(VEHICLE, 1),
    "parameter": lambda: ReadParameter(VEHICLE, "P", BYTEWISE),
    "message": lambda: RequestMessage(VEHICLE, "HOME_POSITION", lambda message: message),
    "camera": lambda: FindCamera(VEHICLE, 1),
    "capture": lambda: ReadCaptureStatus(VEHICLE, 1),
    "image": lambda: ReadImage(VEHICLE, 1),
    "gimbal": lambda: FindGimbal(VEHICLE, 1),
}
LIKELY: dict[str, tuple[int, ...]] = {
    "command": (400, 510, 511, 512, 224),
    "result": (0, 1, 2, 3, 4, 5, 7, 8),
    "type": (0, 1, 2, 13, 14, 15),
    "seq": (0, 1, 2, 3, 4, 65535),
    "count": (0, 1, 4, 65535),
    "mission_type": (0, 0, 1),
    "target_system": (0, 255),
    "target_component": (0, 190),
    "param_index": (0, 1, 2, 65535),
    "param_count": (0, 2, 3, 65535),
    "param_type": tuple(range(12)),
    "error": (0, 1, 4, 99),
}


class Raving(Silent):
    """Says the messages that are wanted, with likely and with absurd fields, a few times a second
    for two minutes."""

    def __init__(self, wanted: frozenset[int], seed: int) -> None:
        self.dice = random.Random(seed)
        self.types = [types_by_id()[id_] for id_ in sorted(wanted)]
        self.next_s = 0.1

    def raves(self) -> Message:
        type_ = self.dice.choice(self.types)
        message = type_.unpack(self.dice.randbytes(type_.struct.size))
        likely = {
            field: self.dice.choice(LIKELY[field])
            for field in message._fields
            if field in LIKELY and self.dice.random() < 0.9
        }
        if "param_index" in likely and type_.name == "PARAM_ERROR":
            likely["param_index"] = 0
        if "param_id" in message._fields:
            likely["param_id"] = self.dice.choice((b"P", b"P", b"Q", b""))
        made: Message = message._replace(**likely)
        return made

    def hear(self, message: Message, now_s: float) -> Sequence[Message]:
        return [self.raves() for _ in range(self.dice.randrange(3))]

    def wake(self, now_s: float) -> Sequence[Message]:
        self.next_s = now_s + self.dice.choice((0.05, 0.3, 2.0)) if now_s < 120.0 else None
        return [self.raves()]


@pytest.mark.parametrize("name", EXCHANGES)
def test_a_raving_vehicle_ends_every_exchange(name: str) -> None:
    for seed in range(30):
        exchange = EXCHANGES[name]()
        played = run(exchange, Raving(exchange.wants, seed), longest_s=600.0)
        assert len(played.sent) < 500


def test_a_raving_gimbal_is_survived() -> None:
    raving, status = Raving(WANTED, 1), GimbalStatus()
    for n in range(2000):
        status.take(raving.raves(), VEHICLE, float(n))
    assert len(status.attitudes) <= 16


@pytest.mark.long
@pytest.mark.parametrize("name", EXCHANGES)
def test_a_raving_vehicle_ends_every_exchange_over_and_over(name: str) -> None:
    for seed in range(30, 3000):
        exchange = EXCHANGES[name]()
        played = run(exchange, Raving(exchange.wants, seed), longest_s=600.0)
        assert len(played.sent) < 500


def test_a_flood_of_requests_is_answered_within_bounds() -> None:
    class Floods(Silent):
        next_s = 0.1

        def wake(self, now_s: float) -> Sequence[Message]:
            self.next_s = now_s + 0.001
            make = message_type("MISSION_REQUEST_INT").make
            return [make(seq=n) for n in range(10)]

    played = run(UploadMission(VEHICLE, ITEMS), Floods())
    assert played.error is not None
    assert len(played.sent) < 100
