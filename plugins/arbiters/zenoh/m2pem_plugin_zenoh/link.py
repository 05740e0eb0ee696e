"""One Zenoh session: requests with one answer, states that are published, and who is there.

Nothing here blocks the event loop. Zenoh may wait while a link is congested, so it is called in
threads: one for what stops vehicles, which waits for nothing else, and others for the rest.
"""

import asyncio
import json
import os
import stat
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from m2pem.api import Fleet, HealthCheck, HealthStatus, Host
from m2pem.api.latest_task import LatestTask
from m2pem.errors import PluginError
from m2pem_plugin_zenoh.arbiter_host import LinkError

if TYPE_CHECKING:
    import zenoh

LEASE_S = 5.0
"""And two round trips: a connection over which nothing has arrived for so long is closed, and made
again. That takes several round trips, so that waiting is better where the way is long."""

OPENED_WITHIN_S = 10.0
"""And four round trips: what the handshakes of TCP, TLS and Zenoh may take."""

ANSWERED_WITHIN_S = 60.0
"""What comes later is dropped."""

RETRY_MS = 500
OPEN_AGAIN_S = 0.5


@dataclass(frozen=True, slots=True)
class Endpoints:
    """Where a session connects to, or listens. One of both is empty."""

    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()


def settings(host: Host, endpoints: Endpoints) -> dict[str, Any]:
    """Return Zenoh's settings by their names.

    Raises:
        PluginError: a file of keys or passwords is missing, or others may read it.
    """
    opened_within_ms = round(1000 * (OPENED_WITHIN_S + 4 * host.round_trip_s))
    found: dict[str, Any] = {
        # One that connects is a client, which a router serves, too.
        "mode": "peer" if endpoints.listen else "client",
        "connect/endpoints": list(endpoints.connect),
        "listen/endpoints": list(endpoints.listen),
        "connect/retry": {
            "period_init_ms": RETRY_MS,
            "period_max_ms": RETRY_MS,
            "period_increase_factor": 1,
        },
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": round(1000 * (LEASE_S + 2 * host.round_trip_s)),
        "transport/unicast/open_timeout": opened_within_ms,
        "transport/unicast/accept_timeout": opened_within_ms,
    }
    if host.ca:
        tls: dict[str, Any] = {"root_ca_certificate": _readable(host.ca)}
        # With a password, only the end that listens has a certificate.
        side = "listen" if endpoints.listen else "connect"
        if host.certificate and (endpoints.listen or not host.credentials):
            tls[f"{side}_certificate"] = _readable(host.certificate)
            tls[f"{side}_private_key"] = _secret(host.key)
        tls["enable_mtls"] = not host.credentials
        found["transport/link/tls"] = tls
    if host.credentials:
        file = _secret(host.credentials)
        user, password = _first_user(file)
        secrets = {"user": user, "password": password}
        if endpoints.listen:
            secrets = {"dictionary_file": file}
        found["transport/auth/usrpwd"] = secrets
    return found


def _readable(file: str) -> str:
    try:
        with Path(file).open("rb"):
            return file
    except OSError as error:
        raise PluginError(f"{file}: {error.strerror}") from error


def _secret(file: str) -> str:
    """Return the name of a file that its owner alone may read; raises PluginError."""
    _readable(file)
    mode = stat.S_IMODE(os.stat(file).st_mode)  # noqa: PTH116  # a text is returned
    if mode & 0o077:
        raise PluginError(f"{file}: others may read it (mode {mode:04o}): chmod 600 {file}")
    return file


def _first_user(file: str) -> tuple[str, str]:
    for line in Path(file).read_text(encoding="utf-8").splitlines():
        user, colon, password = line.strip().partition(":")
        if user and colon:
            return user, password
    raise PluginError(f"{file}: it has no line 'user:password'")


def check_hosts(fleet: Fleet) -> Sequence[HealthCheck]:
    """Check that the executive of this computer can use the files of each host. Nothing is sent."""
    checks = []
    for host in fleet.hosts.values():
        name = f"host {host.name}"
        try:
            settings(host, Endpoints(host.connect, host.listen))
        except PluginError as error:
            remedy = "each computer needs its own files under the names of the fleet file"
            checks.append(HealthCheck(name, HealthStatus.ERROR, str(error), remedy))
        else:
            secured = "with TLS" if host.ca else "on this computer alone"
            checks.append(HealthCheck(name, HealthStatus.OK, f"can be connected {secured}"))
    return checks


class Link:
    """A session. `what`: for the names of threads."""

    def __init__(self, configured: dict[str, Any], what: str) -> None:
        self._settings = configured
        self._urgent = ThreadPoolExecutor(1, f"{what}: stop")
        self._others = ThreadPoolExecutor(2, what)
        self._session: zenoh.Session | None = None
        self._declared: list[Any] = []
        self._loop = asyncio.get_running_loop()
        self._closed = False

    async def open(self) -> None:
        """Open the session; wait until there is something to connect to.

        Raises:
            PluginError: the endpoint or a file of its security cannot be used.
        """
        while self._session is None:
            try:
                self._session = await self._run(partial(_open, self._settings))
            except LinkError as error:
                if self._settings["listen/endpoints"]:
                    raise PluginError(str(error)) from error
                await asyncio.sleep(OPEN_AGAIN_S)

    async def close(self) -> None:
        """Close the session; nothing is called any more."""
        self._closed = True
        session, self._session = self._session, None
        if session is not None:
            with suppress(LinkError):
                await self._run(session.close)
        self._declared.clear()
        for pool in (self._urgent, self._others):
            pool.shutdown(wait=False, cancel_futures=True)
        await asyncio.to_thread(_joined, (self._urgent, self._others))

    # --- requests -------------------------------------------------------------------------------

    async def request(
        self,
        key: str,
        content: bytes,
        timeout_s: float,
        *,
        urgent: bool = False,
        answered: "asyncio.Future[bytes] | None" = None,
    ) -> bytes:
        """Send a request to what answers at a key; returns the answer.

        `urgent`: it goes before everything else, and is never dropped. `answered`: the answer to
        the same request that was sent before, which may come first.

        Raises:
            LinkError: there is no answer within `timeout_s`.
        """
        answer: asyncio.Future[bytes] = answered or self._loop.create_future()
        over: asyncio.Future[bytes] = self._loop.create_future()

        def replied(reply: Any) -> None:
            if reply.ok is not None:
                self._soon(_resolve, answer, reply.ok.payload.to_bytes())

        def ended() -> None:
            self._soon(_resolve, over, b"")

        await self._run(partial(self._get, key, content, urgent, replied, ended), urgent=urgent)
        ends = {answer, over}
        await asyncio.wait(ends, timeout=timeout_s, return_when=asyncio.FIRST_COMPLETED)
        if answer.done():
            return answer.result()
        raise LinkError(
            "the other end is not there" if over.done() else f"no answer within {timeout_s:g} s"
        )

    def _get(
        self,
        key: str,
        content: bytes,
        urgent: bool,
        replied: Callable[[Any], None],
        ended: Callable[[], None],
    ) -> None:
        import zenoh  # noqa: PLC0415  # a check of a fleet needs no Zenoh

        priority = zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.INTERACTIVE_HIGH
        self._opened().get(
            key,
            zenoh.handlers.Callback(replied, ended, indirect=False),
            payload=content,
            timeout=ANSWERED_WITHIN_S,
            priority=priority,
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=True,
        )

    async def answer(self, key: str, handle: Callable[[bytes], Awaitable[bytes]]) -> None:
        """Answer the requests at a key from now on."""
        tasks = LatestTask()

        async def answer(query: Any, content: bytes) -> None:
            answer = await handle(content)
            with suppress(LinkError):
                await self._run(partial(query.reply, query.key_expr, answer), urgent=True)
            query.drop()

        def begin(query: Any, content: bytes) -> None:
            tasks.add(answer(query, content))

        def received(query: Any) -> None:
            content = query.payload.to_bytes() if query.payload is not None else b""
            self._soon(begin, query, content)

        await self._declare(lambda session: session.declare_queryable(key, _handler(received)))

    # --- states, and who is there ---------------------------------------------------------------

    def publish(self, key: str, content: bytes) -> None:
        """Send a state; it is dropped where the link is congested."""

        def put() -> None:
            import zenoh  # noqa: PLC0415  # a check of a fleet needs no Zenoh

            with suppress(zenoh.ZError, LinkError):
                self._opened().put(
                    key,
                    content,
                    priority=zenoh.Priority.DATA_LOW,
                    congestion_control=zenoh.CongestionControl.DROP,
                )

        if not self._closed:
            self._others.submit(put)

    async def subscribe(self, key: str, take: Callable[[bytes], None]) -> None:
        """Have `take` called with each state at a key."""

        def received(sample: Any) -> None:
            self._soon(take, sample.payload.to_bytes())

        await self._declare(lambda session: session.declare_subscriber(key, _handler(received)))

    async def be_there(self, key: str) -> None:
        """Be there, for those who `watch` the key, as long as the session is connected."""
        await self._declare(lambda session: session.liveliness().declare_token(key))

    async def watch(self, key: str, appeared: Callable[[], None]) -> None:
        """Have `appeared` called when someone is there, at first too."""

        def received(sample: Any) -> None:
            import zenoh  # noqa: PLC0415  # a check of a fleet needs no Zenoh

            if sample.kind == zenoh.SampleKind.PUT:
                self._soon(appeared)

        await self._declare(
            lambda session: session.liveliness().declare_subscriber(
                key, _handler(received), history=True
            )
        )

    # --- inside ---------------------------------------------------------------------------------

    async def _declare(self, declare: "Callable[[zenoh.Session], Any]") -> None:
        await self._run(lambda: self._declared.append(declare(self._opened())))

    def _opened(self) -> "zenoh.Session":
        if self._session is None:
            raise LinkError("there is no connection")
        return self._session

    async def _run(self, call: Callable[[], Any], *, urgent: bool = False) -> Any:
        import zenoh  # noqa: PLC0415  # a check of a fleet needs no Zenoh

        pool = self._urgent if urgent else self._others
        try:
            return await self._loop.run_in_executor(pool, call)
        except zenoh.ZError as error:
            raise LinkError(str(error)) from error
        except RuntimeError as error:  # the pool is shut down
            raise LinkError("the link is closed") from error

    def _soon(self, call: Callable[..., None], *arguments: Any) -> None:
        """Have the event loop call something, from a thread of Zenoh."""
        if not self._closed:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(call, *arguments)


def _open(configured: dict[str, Any]) -> "zenoh.Session":
    import zenoh  # noqa: PLC0415  # a check of a fleet needs no Zenoh

    config = zenoh.Config()
    for name, value in configured.items():
        config.insert_json5(name, json.dumps(value))
    return zenoh.open(config)


def _handler(received: Callable[[Any], None]) -> Any:
    import zenoh  # noqa: PLC0415  # a check of a fleet needs no Zenoh

    return zenoh.handlers.Callback(received, indirect=False)


def _resolve(answer: "asyncio.Future[bytes]", content: bytes) -> None:
    if not answer.done():
        answer.set_result(content)


def _joined(pools: Sequence[ThreadPoolExecutor]) -> None:
    for pool in pools:
        pool.shutdown(wait=True)
