"""The executive's end of the socket: what it answers, and to whom."""

import asyncio
import json
import os
import socket
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from m2pem.control_socket import server
from m2pem.control_socket.paths import address, live_sockets
from m2pem.control_socket.server import ControlSocket
from tests.control_socket.conftest import Served

NESTED = b'{"jsonrpc": "2.0", "params": {"a": ' + b"[" * 100_000 + b"]" * 100_000 + b"}}"


async def exchange(path: Path, *lines: bytes) -> list[dict[str, Any]]:
    """Send lines, then hang up; returns all that was answered."""
    with address(path) as there:
        reader, writer = await asyncio.open_unix_connection(there)
    writer.writelines(line + b"\n" for line in lines)
    writer.write_eof()
    answers = await reader.read()
    writer.close()
    return [json.loads(line) for line in answers.splitlines()]


def call(method: str, **params: Any) -> bytes:
    return json.dumps({"jsonrpc": "2.0", "id": 7, "method": method, "params": params}).encode()


def nested(levels: int) -> Any:
    value: Any = []
    for _ in range(levels - 1):
        value = [value]
    return value


async def test_only_the_owner_may_use_the_socket(served: Served) -> None:
    assert stat.S_IMODE(served.path.stat().st_mode) == 0o600
    assert list(live_sockets(served.journal)) == [served.path]


async def test_a_result_carries_the_id_of_its_call(served: Served) -> None:
    [answer] = await exchange(served.path, call("runs"))
    assert answer == {"jsonrpc": "2.0", "id": 7, "result": []}


async def test_a_notification_is_carried_out_and_not_answered(served: Served) -> None:
    run, _ = await served.asked()
    pause = {"jsonrpc": "2.0", "method": "pause", "params": {"run": run}}
    assert await exchange(served.path, json.dumps(pause).encode()) == []
    assert (await served.control.runs())[0].status == "paused"


@pytest.mark.parametrize(
    ("line", "code", "says"),
    [
        (b"{", -32700, ""),
        (NESTED, -32700, "nested too deep"),
        (b'{"jsonrpc": "2.0", "method": "\xff"}', -32700, "utf-8"),
        (call("signal", id="go", data={"a": nested(60)}), -32000, "'a' is nested deeper than 50"),
        (call("set_geometry", name="a", geometry={"b": nested(500)}), -32000, "nested deeper"),
        (b"[]", -32600, "object"),
        (b'{"jsonrpc": "2.0"}', -32600, "method"),
        (call("jump"), -32601, "known: start, check, execute_behavior"),
        (call("pause"), -32602, "run"),
        (call("pause", run=3), -32602, "str"),
        (call("pause", run="r1", force=True), -32602, "force"),
        (call("subscribe", run=3), -32602, "str"),
        (call("pause", run="r1"), -32001, "not driven"),
        (call("mission", run="r1"), -32000, "no run r1"),
    ],
)
async def test_what_is_wrong_is_said(served: Served, line: bytes, code: int, says: str) -> None:
    [answer] = await exchange(served.path, line)
    assert answer["error"]["code"] == code
    assert says in answer["error"]["message"]


@pytest.mark.parametrize("wrong", [b"nonsense", NESTED, b'{"method": "\xff"}'])
async def test_a_wrong_line_is_answered_and_the_next_one_too(served: Served, wrong: bytes) -> None:
    answers = await exchange(served.path, wrong, call("runs"))
    assert ["error" in answer for answer in answers] == [True, False]


async def test_a_line_without_an_end_is_answered(
    served: Served, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "LONGEST_LINE_BYTES", 1000)
    async with ControlSocket(served.control, tmp_path / "other.db") as second:
        assert second.path is not None
        [answer] = await exchange(second.path, b"x" * 5000)
    assert "longer than 1,000 bytes" in answer["error"]["message"]


async def test_a_stop_is_carried_out_among_callers_that_ask_without_end(served: Served) -> None:
    """Some never finish a line, and others never read an answer."""
    run, _ = await served.asked()
    with address(served.path) as there:
        callers = [await asyncio.open_unix_connection(there) for _ in range(200)]
    for number, (_, writer) in enumerate(callers):
        writer.write(b'{"jsonrpc"' if number % 10 else 200 * (call("runs") + b"\n"))
    [answer] = await exchange(served.path, call("stop", run=run))
    assert answer["result"] is None
    assert (await served.control.runs())[0].status == "stopped"
    for _, writer in callers:
        writer.close()


async def test_a_process_of_another_user_is_turned_away(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "is_same_user", lambda _: False)
    with suppress(ConnectionResetError):  # closed with the call unread
        assert await exchange(served.path, call("runs")) == []


def test_the_user_is_recognised_by_what_the_kernel_says() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        assert server.is_same_user(ours)


def test_another_user_is_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    someone_else = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: someone_else)
    ours, theirs = socket.socketpair()
    with ours, theirs:
        assert not server.is_same_user(ours)


async def test_the_socket_goes_with_the_executive(served: Served, tmp_path: Path) -> None:
    async with ControlSocket(served.control, tmp_path / "other.db") as second:
        path = second.path
        assert path is not None
        assert path.exists()
    assert not path.exists()


async def test_a_caller_that_still_listens_does_not_keep_the_executive(
    served: Served, tmp_path: Path
) -> None:
    async with ControlSocket(served.control, tmp_path / "other.db") as second:
        reader, writer = await asyncio.open_unix_connection(str(second.path))
        writer.write(call("subscribe") + b"\n")
        assert await reader.readline()
    assert await reader.read() == b""
    writer.close()


async def test_without_a_place_the_executive_goes_on(
    served: Served, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with ControlSocket(served.control, tmp_path / "no" / "j.db") as unreachable:
        assert unreachable.path is None
    assert "will not reach this" in caplog.text
    async with ControlSocket(served.control, None) as in_memory:
        assert in_memory.path is None
