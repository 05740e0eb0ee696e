"""Messages of m2pem_interfaces, written and read. These modules can be imported without ROS."""

from typing import Any


def own_messages() -> Any:
    """Return m2pem_interfaces.msg, which needs ROS."""
    from m2pem_interfaces import msg  # noqa: PLC0415  # it needs ROS

    return msg


def set_stamp(stamp: Any, time_us: int) -> None:
    """Set a builtin_interfaces/msg/Time to `time_us`, in microseconds since the Unix epoch."""
    stamp.sec, rest_us = divmod(time_us, 1_000_000)
    stamp.nanosec = rest_us * 1000
