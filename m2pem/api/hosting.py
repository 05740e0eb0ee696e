"""Arbiters that run on other hosts, beside their vehicles: what a link to such a host implements.

The executive makes an arbiter of the link, which represents the one on the host. `m2pem
arbiter-host` runs the arbiter there and hands it to `serve` of the same link.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from m2pem.api.arbiter import Arbiter, ArbiterContext, Connection
from m2pem.fleet.hosts import CutOffPolicy, Host, WhenCutOff
from m2pem.mission.catalogue import ResourceId

__all__ = ["CutOffPolicy", "Host", "HostLink", "HostedArbiter", "WhenCutOff"]


@dataclass(frozen=True, slots=True)
class HostedArbiter:
    """An arbiter that runs on a host, as both ends know it by the fleet file.

    `name`: under which it is registered ("mavlink"). `make` makes one that is not connected; the
    executive makes one, too, for its catalogue and limits. `when_cut_off`: by resource; a payload
    has that of its vehicle.
    """

    fleet: str
    host: Host
    name: str
    connections: Mapping[ResourceId, Connection]
    when_cut_off: Mapping[ResourceId, CutOffPolicy]
    make: Callable[[ArbiterContext], Arbiter]


class HostLink(Protocol):
    """A link to hosts, registered as an arbiter."""

    def __call__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        hosted: HostedArbiter | None = None,
    ) -> Arbiter:
        """Make the arbiter that represents `hosted` in the executive."""
        ...

    async def serve(
        self,
        hosted: Sequence[HostedArbiter],
        context: ArbiterContext,
        state: Path,
        *,
        connect: Sequence[str] = (),
        listen: Sequence[str] = (),
        ready: Callable[[str], None] = print,
    ) -> None:
        """Run arbiters of one host until cancelled.

        `context`: its journal and epochs are those of the executive instead, once that connects.
        `state`: a folder that outlives restarts. `connect`, `listen`: endpoints; none: the host
        listens where the executive connects to, or else connects to where that listens. `ready`:
        is called with a line for people once executives can connect.

        Raises:
            PluginError: an endpoint or a file of its security cannot be used, or an arbiter cannot
                connect.
        """
        ...
