"""MAVLink frames a second: all routed, some messages decoded; beside pymavlink's parser.

python -m bench.programs.mavlink_frames <frames>

Both are given the same frames in turn, as datagrams and as a stream. Of ours, CPU seconds include
counting losses for each sender and handing messages to a listener; of pymavlink, `parse_buffer`
alone. Also datagrams that are signed, and whose signatures both check.
"""

import json
import random
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from m2pem_plugin_mavlink.protocol.frames import encode
from m2pem_plugin_mavlink.protocol.inbound import Inbound, Sender, Wanted
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type
from m2pem_plugin_mavlink.signing.signature import SignatureCheck, Signer, Signing
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.measured import again_and_again

VEHICLES = 10
KEY = bytes(range(32))
CHUNK_BYTES = 4096
RATES_HZ = {
    "HEARTBEAT": 1, "SYS_STATUS": 2, "SYSTEM_TIME": 1, "GPS_RAW_INT": 2, "RAW_IMU": 4,
    "SCALED_PRESSURE": 2, "ATTITUDE": 10, "LOCAL_POSITION_NED": 2, "GLOBAL_POSITION_INT": 5,
    "SERVO_OUTPUT_RAW": 4, "RC_CHANNELS": 4, "MISSION_CURRENT": 2, "NAV_CONTROLLER_OUTPUT": 2,
    "VFR_HUD": 4, "POWER_STATUS": 1, "BATTERY_STATUS": 1, "AHRS": 2, "HWSTATUS": 1, "AHRS2": 2,
    "EKF_STATUS_REPORT": 2, "VIBRATION": 2, "HOME_POSITION": 1, "EXTENDED_SYS_STATE": 1,
}  # fmt: skip
"""What a vehicle sends to a ground station that asks for the usual streams."""

WANTED = (
    "HEARTBEAT", "SYS_STATUS", "GPS_RAW_INT", "ATTITUDE", "GLOBAL_POSITION_INT", "MISSION_CURRENT",
    "COMMAND_ACK", "BATTERY_STATUS", "EKF_STATUS_REPORT", "EXTENDED_SYS_STATE", "STATUSTEXT",
)  # fmt: skip


def frames(count: int, sign: Callable[[bytes], bytes] | None = None) -> list[bytes]:
    """Frames of several vehicles, with any values."""
    rng = random.Random(1)
    numbers = [0] * VEHICLES
    made = []
    names = rng.choices([*RATES_HZ], weights=[*RATES_HZ.values()], k=count)
    for name in names:
        type_ = message_type(name)
        vehicle = rng.randrange(VEHICLES)
        message = type_.unpack(rng.randbytes(type_.struct.size))
        made.append(encode(message, numbers[vehicle] & 255, Address(vehicle + 1, 1), sign))
        numbers[vehicle] += 1
    return made


class Ear:
    """Our side. `check`: of the signatures of all frames."""

    def __init__(self, check: SignatureCheck | None = None) -> None:
        self.heard: list[Message] = []
        types = [message_type(name) for name in WANTED]
        wanted = {each.id: Wanted(each, (self._hear,)) for each in types}

        def meet(sender: Sender) -> bool:
            sender.wanted = wanted
            return True

        self.inbound = Inbound(meet, lambda _: check)

    def _hear(self, message: Message, _: Address) -> None:
        self.heard.append(message)


def ours(pieces: Sequence[bytes], stream: bool, *, signed: bool = False) -> tuple[float, Ear]:
    """CPU seconds, and what was heard."""
    ear = Ear(SignatureCheck(signing()) if signed else None)
    take = ear.inbound.stream if stream else ear.inbound.datagram
    began_s = time.process_time()
    for piece in pieces:
        take(piece, 1.0)
    return time.process_time() - began_s, ear


def signing() -> Signing:
    """A key, and no frame received yet."""
    return Signing(Signer(KEY, None), Path(), 1)


def theirs(pieces: Sequence[bytes], *, signed: bool = False) -> tuple[float, list[Any]]:
    """CPU seconds, and all messages."""
    mav = dialect.MAVLink(None)
    mav.robust_parsing = True
    if signed:
        mav.signing.secret_key = KEY
    parsed: list[Any] = []
    began_s = time.process_time()
    for piece in pieces:
        parsed += mav.parse_buffer(piece) or ()
    return time.process_time() - began_s, parsed


def same(ear: Ear, parsed: Sequence[Any], count: int) -> None:
    """Nothing is lost, and what is decoded is the same."""
    senders = ear.inbound.senders.values()
    assert len(parsed) == count == sum(each.sent for each in senders)
    assert not any(each.lost or each.doubled for each in senders)
    expected = [each for each in parsed if each.get_type() in WANTED]
    assert len(expected) == len(ear.heard)
    for mine, other in zip(ear.heard, expected, strict=True):
        assert mine.TYPE.name == other.get_type()
        for name, value in mine._asdict().items():
            their = getattr(other, name)
            their = tuple(their) if isinstance(their, list) else their
            assert value == their or value != value, (mine, name)  # noqa: PLR0124  # NaN


def measure(count: int) -> dict[str, float]:
    """Both, in turn."""
    datagrams = frames(count)
    signed = frames(count, signing().sign)
    joined = b"".join(datagrams)
    stream = [joined[at : at + CHUNK_BYTES] for at in range(0, len(joined), CHUNK_BYTES)]
    figures: dict[str, float] = {}
    kinds: dict[str, tuple[Callable[[], tuple[float, Ear]], Sequence[bytes]]] = {
        "": (lambda: ours(datagrams, stream=False), datagrams),
        "stream_": (lambda: ours(stream, stream=True), stream),
        "signed_": (lambda: ours(signed, stream=False, signed=True), signed),
    }
    for prefix, (mine, pieces) in kinds.items():
        mine_s, ear = again_and_again(mine)
        their_s, parsed = again_and_again(
            lambda: theirs(pieces, signed=pieces is signed)  # noqa: B023  # called at once
        )
        same(ear, parsed, count)
        figures[f"{prefix}frames_per_s"] = count / mine_s
        figures[f"{prefix}times"] = their_s / mine_s
    return figures


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
