"""An executive with a simulated vehicle, the page served on 127.0.0.1, and browsers without one."""

import asyncio
import json
import sys
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
import websockets
from m2pem_plugin_web.access.passwords import hash_password
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.access.sign_in import KEY_HEADER, KEY_SUBPROTOCOL, SUBPROTOCOL
from m2pem_plugin_web.access.users import User, write_users
from m2pem_plugin_web.ocu import WebOcu

from m2pem.api import MissionControl, OpenPrompt, RunId
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.journal import Journal, MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.rehearsal.worker import rehearse_in_subprocess
from m2pem.simulation.estimates import estimate_mission
from m2pem.testing import scenarios

WITHIN_S = 60.0
VEHICLE = "ugv1"
SPEED = 20.0
SLOW_S = 60.0
"""A machine on which many tests run may take that long to answer."""
PASSWORD = "correct horse"
PLUGINS = PluginManager()
"""Those that are installed. Looked for once: it takes longer than most tests."""

# httpx looks for it at each request, in all folders of sys.path where it is not installed.
with suppress(ImportError):
    import sniffio  # noqa: F401
sys.modules.setdefault("sniffio", None)  # type: ignore[arg-type]  # Python's sign for "there is none"


class Live:
    """A WebSocket to the page: all that was said is kept, and acknowledged unless told not to."""

    def __init__(self, socket: websockets.ClientConnection, *, acknowledges: bool = True) -> None:
        self.socket = socket
        self.said: list[dict[str, Any]] = []
        self.closed: int | None = None
        self.acknowledges = acknowledges
        self._more = asyncio.Event()
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        try:
            async for text in self.socket:
                message = json.loads(text)
                self.said.append(message)
                self._more.set()
                if self.acknowledges and message["type"] in ("snapshot", "frame"):
                    await self.send(type="ack", seq=message["seq"])
        except websockets.ConnectionClosed:
            pass
        finally:
            await self.socket.wait_closed()
            self.closed = self.socket.close_code
            self._more.set()

    async def send(self, **message: Any) -> None:
        await self.socket.send(json.dumps(message))

    async def watch(self, run: RunId | None) -> dict[str, Any]:
        """Watch a run; its snapshot."""
        before = len(self.said)
        await self.send(type="watch", run=run)
        return await self.until(lambda message: message["type"] == "snapshot", before)

    async def until(
        self, wanted: Callable[[dict[str, Any]], bool], start: int = 0
    ) -> dict[str, Any]:
        """Wait for a message; the first of those from `start` on."""
        place = start
        async with asyncio.timeout(WITHIN_S):
            while True:
                for message in self.said[place:]:
                    place += 1
                    if wanted(message):
                        return message
                assert self.closed is None, f"closed with {self.closed}"
                self._more.clear()
                await self._more.wait()

    async def until_closed(self) -> int:
        """Wait until the server has closed it; its code."""
        async with asyncio.timeout(WITHIN_S + 10):
            while self.closed is None:
                self._more.clear()
                await self._more.wait()
        return self.closed

    def elements(self) -> dict[tuple[str, str], dict[str, Any]]:
        """The states of elements, as a page that took in every message has them."""
        states: dict[tuple[str, str], dict[str, Any]] = {}
        for message in self.said:
            if message["type"] == "snapshot":
                states.clear()
            for process, elements in message.get("elements", {}).items():
                states.update({(process, name): state for name, state in elements.items()})
        return states

    async def close(self) -> None:
        await self.socket.close()
        await self._reading


class Browser:
    """What a page does: keeps cookie and key, and says its origin. `http` is an httpx client."""

    # No certificates are read where none is used: that takes longer than most tests.
    def __init__(self, base: str, verify: Any = False) -> None:
        self.base = base
        self.http = httpx.AsyncClient(
            base_url=base, headers={"Origin": base}, verify=verify, timeout=SLOW_S
        )
        self.lives: list[Live] = []

    @property
    def cookie(self) -> str:
        return "; ".join(f"{name}={value}" for name, value in self.http.cookies.items())

    @property
    def key(self) -> str:
        return str(self.http.headers.get(KEY_HEADER, ""))

    @key.setter
    def key(self, key: str) -> None:
        self.http.headers[KEY_HEADER] = key

    @property
    def secrets(self) -> dict[str, str]:
        """Headers of a request of its session."""
        return {"Cookie": self.cookie, KEY_HEADER: self.key}

    async def open(self, url: str) -> "Browser":
        response = await self.http.get(url, headers={"Sec-Fetch-Site": "none"})
        assert response.status_code == 200, response.text
        return await self._begin({"token": token_of(url)})

    async def sign_in(self, name: str, password: str = PASSWORD) -> "Browser":
        return await self._begin({"name": name, "password": password})

    async def _begin(self, wanted: object) -> "Browser":
        response = await self.http.post("/api/session", json=wanted)
        assert response.status_code == 200, response.text
        self.key = response.json()["key"]
        return self

    async def live(self, *, acknowledges: bool = True, **options: Any) -> Live:
        socket = await connect(self.base, cookie=self.cookie, key=self.key, **options)
        self.lives.append(Live(socket, acknowledges=acknowledges))
        return self.lives[-1]

    async def close(self) -> None:
        for live in self.lives:
            await live.close()
        await self.http.aclose()


def token_of(url: str) -> str:
    """The token of a printed address."""
    return parse_qs(urlsplit(url).query)["token"][0]


async def connect(
    base: str,
    *,
    cookie: str = "",
    key: str = "",
    origin: str | None = "",
    host: str = "",
    **options: Any,
) -> websockets.ClientConnection:
    """A WebSocket. `origin` "": the page's own; None: it says none."""
    headers = {"Cookie": cookie} if cookie else {}
    # Its own Host header comes first and would count: the address of another name is dialled.
    where = base.replace("http", "ws", 1)
    if host:
        port = int(where.rpartition(":")[2])
        where, options = f"ws://{host}", {**options, "host": "127.0.0.1", "port": port}
    return await websockets.connect(
        f"{where}/api/live",
        additional_headers=headers,
        subprotocols=[
            websockets.Subprotocol(each)
            for each in (SUBPROTOCOL, *([KEY_SUBPROTOCOL + key] if key else []))
        ],
        origin=websockets.Origin(base) if origin == "" else origin,  # type: ignore[arg-type]
        compression=None,
        close_timeout=1,
        **options,
    )


@dataclass
class World:
    """An executive, and the page that is served for it."""

    control: MissionControl
    ocu: WebOcu
    missions: Path
    browsers: list[Browser] = field(default_factory=list)

    @property
    def base(self) -> str:
        return self.ocu.url.partition("?")[0].rstrip("/")

    def stranger(self) -> Browser:
        """A browser that has not signed in."""
        self.browsers.append(Browser(self.base))
        return self.browsers[-1]

    async def browser(self, user: str = "") -> Browser:
        """A browser that has signed in: with the token, or as a user."""
        stranger = self.stranger()
        return await (stranger.sign_in(user) if user else stranger.open(self.ocu.url))

    async def asked(self, mission: bytes | None = None) -> OpenPrompt:
        """Start a mission, and wait for its question."""
        run = await self.control.start(mission or scenarios.question(), by="test")
        async with asyncio.timeout(WITHIN_S):
            async for notice in self.control.subscribe(run):
                if isinstance(notice, OpenPrompt):
                    return notice
        raise AssertionError("the executive has ended")


@asynccontextmanager
async def serving(
    control: MissionControl, folder: Path, environment: Mapping[str, str]
) -> AsyncIterator[World]:
    """The page of an executive; its files are in `folder`."""
    missions = folder / "missions"
    missions.mkdir(exist_ok=True)
    said = {
        "M2PEM_WEB_PORT": "0",
        "M2PEM_WEB_MISSIONS": str(missions),
        "XDG_STATE_HOME": str(folder),
        **environment,
    }
    ocu = WebOcu(control, environment=said)
    task = asyncio.create_task(ocu.serve())
    world = World(control, ocu, missions)
    try:
        yield world
    finally:
        for browser in world.browsers:
            await browser.close()
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


class MakeWorld:
    """Makes worlds, in `folder`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @asynccontextmanager
    async def __call__(
        self, *, users: Mapping[str, Role] | None = None, **environment: str
    ) -> AsyncIterator[World]:
        """`users`: named, all with the same password."""
        if users:
            path = self.folder / "users.json"
            write_users(path, {name: User(role, HASHED()) for name, role in users.items()})
            environment = {"M2PEM_WEB_USERS": str(path), **environment}
        running = executive(MemoryJournal())
        async with running, serving(running.control, self.folder, environment) as world:
            yield world


def executive(journal: Journal, plugins: PluginManager | None = None) -> Executive:
    """One with a simulated vehicle, that can also rehearse."""
    return Executive(
        scenarios.fleet("sim", {VEHICLE: {}}),
        journal,
        plugins or PLUGINS,
        SystemClock(SPEED),
        speed=SPEED,
        rehearse=rehearse_in_subprocess,
        estimate=estimate_mission,
    )


class _Hashed:
    """Made once: it takes long on purpose."""

    def __init__(self) -> None:
        self._hashed = ""

    def __call__(self) -> str:
        self._hashed = self._hashed or hash_password(PASSWORD)
        return self._hashed


HASHED = _Hashed()


@pytest.fixture
def world(tmp_path: Path) -> MakeWorld:
    """Makes executives with pages."""
    return MakeWorld(tmp_path)
