"""A mission that waits for a battery, told over UDP by simulated autopilots."""

import asyncio
import signal
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from m2pem.api import OpenPrompt, When
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager

SPEED = 20.0
ASK = b"""<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:m2pem="https://m2pem.org/schema/1"
             targetNamespace="test">
  <process id="P" isExecutable="true">
    <startEvent id="S"/><sequenceFlow id="F1" sourceRef="S" targetRef="Ask"/>
    <userTask id="Ask"><extensionElements><m2pem:prompt>Go?</m2pem:prompt>
      <m2pem:decision value="yes" label="Yes"/></extensionElements></userTask>
    <sequenceFlow id="F2" sourceRef="Ask" targetRef="E"/><endEvent id="E"/>
  </process>
</definitions>"""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_port:
        any_port.bind(("127.0.0.1", 0))
        return int(any_port.getsockname()[1])


@asynccontextmanager
async def autopilot(port: int, *faults: str) -> AsyncIterator[None]:
    """A rover of `m2pem sim mavlink` that sends to a port."""
    words = [word for fault in faults for word in ("--fault", fault)]
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "m2pem", "sim", "mavlink", "--copters", "0", "--rovers", "1"),
        *("--to", f"udp://127.0.0.1:{port}", "--speed", f"{SPEED:g}", *words),
        stdout=asyncio.subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        await process.wait()


async def test_a_mission_starts_when_the_battery_is_charged(tmp_path: Path) -> None:
    port = free_port()
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(
        "version: 1\nname: rover\norigin: {lat: 47.4, lon: 8.5, alt: 400}\n"
        "schedule: {warning: 0 s}\nvehicles:\n  rover1: {domain: ground, arbiter: mavlink, "
        f'connection: {{url: "udpin://127.0.0.1:{port}", system_id: 1}}, sitl: true}}\n'
    )
    executive = Executive(
        load_fleet(str(fleet)),
        MemoryJournal(),
        PluginManager(),
        SystemClock(SPEED),
        speed=SPEED,
        watch_links=False,
    )
    when = When(condition="vehicle.battery > 0.9", vehicles=("rover1",), held_for_s=10.0)
    async with asyncio.timeout(120), executive:
        await executive.load_schedule()
        executive.serve_schedule()
        control = executive.control
        assert await control.schedule(ASK, when=when) == "s1"

        changes = control.subscribe()

        async def reason(text: str) -> None:
            async for _ in changes:
                if text in (await control.scheduled()).entries[0].reason:
                    return

        await reason("its link is lost")
        async with autopilot(port, "battery 50 %"):
            await reason("vehicle.battery is 0.")
            assert await control.runs() == []
        async with autopilot(port):
            async for event in changes:
                if isinstance(event, OpenPrompt):
                    break
        (entry,) = (await control.scheduled()).entries
        assert (entry.run, entry.status) == ("r1", "ended")
