"""A vehicle on a serial line; the line is a pseudo-terminal."""

import asyncio
import os
import subprocess
import sys
import termios
import tty
from pathlib import Path
from typing import Any

import pytest
import serial_asyncio_fast
from m2pem_plugin_mavlink.link import routed_link, streams
from m2pem_plugin_mavlink.link.routed_link import open_link
from m2pem_plugin_mavlink.protocol.messages import Address, message_type
from mavlink_wire import GROUND_STATION, FarEnd, HandClock, until

from m2pem.errors import PluginError


class Line:
    """Its other end: what is written there, and what is read."""

    def __init__(self) -> None:
        self.far, self.near = os.openpty()
        tty.setraw(self.far)
        tty.setraw(self.near)
        self.path = os.ttyname(self.near)
        self.end = FarEnd()
        self.end.transport = self
        os.set_blocking(self.far, False)
        asyncio.get_running_loop().add_reader(self.far, self._read)

    def _read(self) -> None:
        try:
            self.end.data_received(os.read(self.far, 4096))
        except OSError:
            asyncio.get_running_loop().remove_reader(self.far)

    def write(self, data: bytes) -> None:
        """As a transport."""
        os.write(self.far, data)

    def cut(self) -> None:
        """Pull the plug."""
        asyncio.get_running_loop().remove_reader(self.far)
        os.close(self.far)
        os.close(self.near)


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streams, "FIRST_PAUSE_S", 0.01)
    monkeypatch.setattr(streams, "LONGEST_PAUSE_S", 0.02)


async def test_a_vehicle_on_a_serial_line_is_heard_and_spoken_to() -> None:
    line = Line()
    link = await open_link(Address(1, 1), [f"serial://{line.path}:57600"], HandClock())
    modes: list[int] = []
    link.listen([0], lambda message, _: modes.append(message.custom_mode))
    await until(lambda: line.end.beats() == [GROUND_STATION])
    line.write(b"ArduPilot starting\r\n\xfd\xfe\x00")
    for mode in range(50):
        line.end.beat(mode)
    await until(lambda: modes == [*range(50)])
    link.send(message_type("COMMAND_LONG").make(target_system=1, target_component=1))
    await until(lambda: line.end.names() == ["COMMAND_LONG"])
    await link.close()
    line.cut()


async def test_a_line_that_is_pulled_out_is_opened_again(tmp_path: Path) -> None:
    line = Line()
    device = tmp_path / "ttyACM0"
    device.symlink_to(line.path)
    link = await open_link(Address(1, 1), [f"serial://{device}:115200"], HandClock())
    modes: list[int] = []
    link.listen([0], lambda message, _: modes.append(message.custom_mode))
    await until(line.end.beats)
    line.end.beat(1)
    await until(lambda: modes == [1])
    line.cut()
    await until(lambda: link.quality() is None)
    line = Line()
    device.unlink()
    device.symlink_to(line.path)
    await until(line.end.beats)
    line.end.beat(2)
    await until(lambda: modes == [1, 2])
    await link.close()
    line.cut()


async def test_a_line_that_is_not_there_yet_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "ttyACM0"
    link = await open_link(Address(1, 1), [f"serial://{path}:57600"], HandClock())
    line = Line()
    path.symlink_to(line.path)
    await until(line.end.beats)
    await link.close()
    line.cut()


@pytest.mark.parametrize("problem", [termios.error(22, "Invalid argument"), ValueError("baudrate")])
async def test_whatever_is_wrong_with_a_line_it_is_tried_again(
    problem: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = serial_asyncio_fast.create_serial_connection
    problems = [problem] * 3

    async def fails_at_first(*args: Any, **settings: Any) -> Any:
        if problems:
            raise problems.pop()
        return await opened(*args, **settings)

    monkeypatch.setattr(serial_asyncio_fast, "create_serial_connection", fails_at_first)
    line = Line()
    link = await open_link(Address(1, 1), [f"serial://{line.path}:57600"], HandClock())
    await until(line.end.beats)
    await link.close()
    line.cut()


async def test_a_missing_library_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial_asyncio_fast", None)
    with pytest.raises(PluginError, match=r"pip install 'm2pem-plugin-mavlink\[serial\]'"):
        await open_link(Address(1, 1), ["serial:///dev/ttyACM0:57600"], HandClock())


def test_who_has_no_serial_line_does_not_load_what_reads_it() -> None:
    program = f"import sys, {routed_link.__name__}; assert 'serial' not in sys.modules"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, check=False)
    assert done.returncode == 0
