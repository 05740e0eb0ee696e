"""The link to hosts `zenoh`: makes the executive's end, and serves a host's."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from m2pem.api import ArbiterContext, Connection, HostedArbiter, ResourceId
from m2pem.errors import PluginError
from m2pem_plugin_zenoh import messages as m
from m2pem_plugin_zenoh.arbiter_host import ArbiterHost, LinkError
from m2pem_plugin_zenoh.link import Endpoints, Link, settings
from m2pem_plugin_zenoh.remote_arbiter import RemoteArbiter
from m2pem_plugin_zenoh.store import HostStore

DELIVERED_WITHIN_S = 10.0


def prefix(hosted: HostedArbiter) -> str:
    """Return where an arbiter of a host is found: the beginning of its keys."""
    names = (hosted.fleet, hosted.host.name, hosted.name)
    return "/".join(("m2pem", *(quote(name, safe="") for name in names)))


class ZenohHosts:
    """Implements `m2pem.api.HostLink`."""

    def __call__(
        self,
        connections: Mapping[ResourceId, Connection],
        context: ArbiterContext,
        hosted: HostedArbiter | None = None,
    ) -> RemoteArbiter:
        """Make the arbiter that represents `hosted` in the executive.

        Raises:
            PluginError: a vehicle names it as its arbiter.
        """
        if hosted is None:
            raise PluginError(
                f"{', '.join(connections)}: 'zenoh' is the link to another host, not the arbiter "
                "of a vehicle: keep the vehicle's own arbiter, and add `host: NAME`"
            )
        return RemoteArbiter(hosted, context, prefix(hosted))

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
        """Run arbiters of one host until cancelled; see `HostLink`."""
        host = hosted[0].host
        endpoints = Endpoints(tuple(connect), tuple(listen))
        if not (connect or listen):
            endpoints = Endpoints(connect=host.listen, listen=host.connect)
        link = Link(settings(host, endpoints), "host")
        hosts: list[ArbiterHost] = []
        try:
            for each in hosted:
                store = HostStore(state / f"{each.name}.db", context.logger)
                hosts.append(ArbiterHost(each, context, store, _Outlet(link, prefix(each))))
                await hosts[-1].open()
            if endpoints.connect:
                ready(f"host {host.name} connects to {', '.join(endpoints.connect)}")
            await link.open()
            for each, arbiter_host in zip(hosted, hosts, strict=True):
                await link.answer(f"{prefix(each)}/request", arbiter_host.handle)
                await link.be_there(f"{prefix(each)}/alive")
            if endpoints.listen:
                ready(f"host {host.name} listens at {', '.join(endpoints.listen)}")
            await asyncio.Event().wait()
        finally:
            for arbiter_host in hosts:
                await arbiter_host.close()
            await link.close()


class _Outlet:
    """Implements `Outlet` for one arbiter."""

    def __init__(self, link: Link, key: str) -> None:
        self._link = link
        self._key = key

    async def deliver(self, executive: str, items: m.Items) -> int:
        content = m.encode(items)
        key = f"{self._key}/{executive}/items"
        answer = await self._link.request(key, content, DELIVERED_WITHIN_S)
        try:
            received: m.Received = m.decode(answer, m.Received)
        except m.MessageError as error:
            raise LinkError(str(error)) from error
        return received.number

    def publish(self, executive: str, states: bytes) -> None:
        self._link.publish(f"{self._key}/{executive}/state", states)
