"""One connection to ROS for all cameras of a domain, while any of them needs it."""

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    from m2pem_plugin_ros import RosRuntime


@dataclass(slots=True)
class _Shared:
    runtime: "RosRuntime"
    users: int = 0


_shared: WeakKeyDictionary[asyncio.AbstractEventLoop, dict[int | None, _Shared]] = (
    WeakKeyDictionary()
)


def join(domain_id: int | None, name: str) -> "RosRuntime":
    """The connection to a domain, which is named `name` if it is new.

    Raises:
        RosError: ROS cannot be used; the text says what would be right.
    """
    from m2pem_plugin_ros import RosRuntime  # noqa: PLC0415  # it needs rclpy

    domains = _shared.setdefault(asyncio.get_running_loop(), {})
    if domain_id not in domains:
        domains[domain_id] = _Shared(RosRuntime(name, domain_id=domain_id))
    domains[domain_id].users += 1
    return domains[domain_id].runtime


async def leave(domain_id: int | None) -> None:
    """Undo one `join`."""
    domains = _shared[asyncio.get_running_loop()]
    shared = domains[domain_id]
    shared.users -= 1
    if not shared.users:
        del domains[domain_id]
        await shared.runtime.close()
