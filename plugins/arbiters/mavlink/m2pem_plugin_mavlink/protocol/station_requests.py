"""What ground stations for ArduPilot ask of every vehicle: data streams, and files.

MAVLink has replaced REQUEST_DATA_STREAM by MAV_CMD_SET_MESSAGE_INTERVAL; MAVProxy sends it every
10 s. Stations try MAVLink FTP before the parameter protocol, and wait long if nothing answers.
"""

from collections.abc import Mapping
from struct import Struct

from m2pem_plugin_mavlink.protocol.messages import Message, message_type

_STREAMS: Mapping[int, tuple[str, ...]] = {
    2: ("SYS_STATUS", "GPS_RAW_INT", "MISSION_CURRENT", "NAV_CONTROLLER_OUTPUT", "FENCE_STATUS"),
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    10: ("ATTITUDE",),
    11: ("VFR_HUD",),
    12: ("SYSTEM_TIME", "BATTERY_STATUS", "TERRAIN_REPORT", "EKF_STATUS_REPORT"),
}
"""What ArduPilot streams, by MAV_DATA_STREAM: extended status, position, extra 1 to 3; 0 is all."""

_FTP_HEADER = Struct("<HBBBBBxI")
"""Sequence number, session, opcode, bytes of data, requested opcode, burst complete, offset."""

_FTP_ACK, _FTP_NAK, _UNKNOWN_COMMAND = 128, 129, 7
_FTP_BYTES = 251


def requested_intervals(request: Message) -> dict[int, float]:
    """Return the intervals in seconds that REQUEST_DATA_STREAM sets, by message id; below 0: the
    message is not sent any more."""
    rate_hz, stream = request.req_message_rate, request.req_stream_id
    interval_s = 1 / rate_hz if rate_hz and request.start_stop else -1.0
    groups = [names for group, names in _STREAMS.items() if stream in (0, group)]
    return {message_type(name).id: interval_s for names in groups for name in names}


def refusal_of_ftp(payload: bytes) -> bytes | None:
    """Return the payload of FILE_TRANSFER_PROTOCOL that refuses one: a NAK, as there are no files;
    None: it is an answer itself."""
    sequence, session, opcode, *_ = _FTP_HEADER.unpack_from(payload)
    if opcode in (_FTP_ACK, _FTP_NAK):
        return None
    header = _FTP_HEADER.pack((sequence + 1) & 0xFFFF, session, _FTP_NAK, 1, opcode, 0, 0)
    return (header + bytes([_UNKNOWN_COMMAND])).ljust(_FTP_BYTES, b"\0")
