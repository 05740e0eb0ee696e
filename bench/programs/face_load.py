"""Many MAVLink and ROS vehicles in one executive with faces: what is lost, and what it costs.

python -m bench.programs.face_load <MAVLink vehicles> <messages/s> <ROS vehicles> <Hz> <s> FACES

FACES: names with commas, or "none". The vehicles are processes of their own, over UDP and DDS on
127.0.0.1; the former speak to ports of 200 each. For the faces `ros` and `prometheus`, a node
subscribes to odom, fix, battery_state and imu of ten MAVLink vehicles, and /metrics is scraped once
a second; nobody listens to the others. `lost`: MAVLink messages, by their sequence numbers.
`longest_s`: the longest time without a state of the same vehicle.
"""

import asyncio
import json
import socket
import sys
import tempfile
import urllib.request
from collections.abc import Sequence
from contextlib import ExitStack
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.udp import UdpEndpoint
from m2pem_plugin_mavlink.protocol.url import parse_url

from bench.measured import Stopwatch, peak_kb
from bench.programs.face_readers import face, free_port
from bench.programs.mavlink_rovers import HOME, PER_PORT, address, started
from bench.programs.ros_fleet import Heard
from bench.programs.ros_stage import Vehicles, own_domain
from m2pem.api.clock import SystemClock
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet import Domain, Fleet, Vehicle
from m2pem.journal import MemoryJournal
from m2pem.mission.catalogue import ResourceId
from m2pem.plugins import PluginManager

PATIENCE_S = 120.0
READ = 10
READER = Path(__file__).with_name("ros_reader.py")


def udp_port() -> int:
    """One that is free now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def fleet(urls: Sequence[str], mavlink: int, ros: int, domain: int) -> Fleet:
    """Vehicles v0, v1 and so on: first those of MAVLink."""
    settings: list[tuple[str, dict[str, Any]]] = [
        ("mavlink", {"url": urls[each // PER_PORT], "system_id": address(each).system})
        for each in range(mavlink)
    ]
    settings += [
        ("ros", {"namespace": f"/v{number}", "domain_id": domain})
        for number in range(mavlink, mavlink + ros)
    ]
    vehicles = [
        Vehicle(ResourceId(f"v{number}"), Domain.GROUND, arbiter, connection, sitl=True)
        for number, (arbiter, connection) in enumerate(settings)
    ]
    return Fleet("bench", "bench.yaml", {each.id: each for each in vehicles}, origin=(*HOME, 0.0))


def counted(urls: Sequence[str]) -> tuple[int, int]:
    """How many MAVLink frames came, and how many were lost."""
    endpoints = [shared_hub().endpoint(parse_url(url)) for url in urls]
    found = [
        sender
        for endpoint in endpoints
        if isinstance(endpoint, UdpEndpoint)
        for peer in endpoint.peers.values()
        for sender in peer.inbound.senders.values()
    ]
    return sum(each.sent - each.lost for each in found), sum(each.lost for each in found)


def scrape(port: int) -> None:
    """Read /metrics."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics") as page:
        page.read()


async def measure(
    mavlink: int, ros: int, seconds: float, names: Sequence[str], domain: int, pipe: Connection
) -> dict[str, float]:
    """Hear them."""
    ports = [udp_port() for _ in range(0, mavlink, PER_PORT)]
    urls = [f"udpin://127.0.0.1:{port}" for port in ports]
    watch = Stopwatch()
    metrics = free_port()
    with ExitStack() as stack:
        scratch = stack.enter_context(tempfile.TemporaryDirectory(dir=Path.cwd()))
        settings: dict[str, dict[str, Any]] = {
            "ros": {"domain_id": domain},
            "prometheus": {"port": metrics},
            "recorder": {"folder": scratch, "min_free_mb": 0},
            "mavlink": {"url": f"udpout://127.0.0.1:{udp_port()}"},
        }
        all_of_them = fleet(urls, mavlink, ros, domain)
        async with Executive(
            all_of_them, MemoryJournal(), PluginManager(), SystemClock()
        ) as running:
            pipe.send(ports)
            faces = [
                asyncio.create_task(face(name, running.control, settings[name]).serve())
                for name in names
            ]
            heard = Heard(running)
            listening = asyncio.create_task(heard.listen())
            async with asyncio.timeout(PATIENCE_S):
                while len(heard.first_s) < mavlink + ros:  # noqa: ASYNC110  # nobody tells
                    await asyncio.sleep(0.05)
            if "ros" in names:
                from m2pem_plugin_ros.testing import Peer  # noqa: PLC0415

                reader = Peer(READER, domain, ("count", str(min(READ, mavlink))), forked=False)
                stack.callback(reader.kill)
                await asyncio.wait_for(asyncio.to_thread(reader.wait_for, "ready"), PATIENCE_S)
            heard.begin()
            before, lost = counted(urls)
            with watch:
                for _ in range(int(seconds)):
                    await asyncio.sleep(1)
                    if "prometheus" in names:
                        await asyncio.to_thread(scrape, metrics)
            after, lost_after = counted(urls)
            heard.end()
            dropped = (await running.control.statistics()).telemetry_dropped
            broken = [each for each in faces if each.done()]
            listening.cancel()
            for each in faces:
                each.cancel()
            await asyncio.gather(*faces, return_exceptions=True)
            pipe.send("stop")
    assert not broken, f"a face has ended: {broken}"
    return {
        "lost": float(lost_after - lost),
        "messages_per_s": (after - before) / watch.wall_s,
        "states_per_s": heard.count / watch.wall_s,
        "states_dropped": float(dropped),
        "longest_s": heard.longest_s,
        "cpu_percent": 100 * watch.cpu_s / watch.wall_s,
        "peak_mb": peak_kb() / 1024,
    }


def main() -> None:
    """The command."""
    mavlink, rate_hz, ros = map(int, sys.argv[1:4])
    ros_hz, seconds = map(float, sys.argv[4:6])
    names = [] if sys.argv[6] == "none" else sys.argv[6].split(",")
    rovers, pipe = started(mavlink, rate_hz)
    with own_domain() as domain, ExitStack() as stack:
        if ros:
            stack.enter_context(Vehicles(domain, ros, ros_hz, mavlink))
        answer = asyncio.run(measure(mavlink, ros, seconds, names, domain, pipe))
    rovers.join()
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
