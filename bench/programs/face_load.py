"""Many MAVLink and ROS vehicles in one executive with faces: what is lost, and what it costs.

python -m bench.programs.face_load <MAVLink vehicles> <messages/s> <ROS vehicles> <Hz> <s> FACES
    [HOSTS]

FACES: names with commas, or "none". HOSTS: how many processes of `m2pem arbiter-host` share the
ROS vehicles; with 0, they are in the executive's own process. The vehicles are processes of their
own, over UDP and DDS on 127.0.0.1; the former speak to ports of 200 each. For the faces `ros` and
`prometheus`, a node subscribes to odom, fix, battery_state and imu of ten MAVLink vehicles, and
/metrics is scraped once a second; the others have no listener. `lost`: MAVLink messages, by their
sequence numbers. `longest_s`: the longest time without a state of the same vehicle. `late_s`: the
longest time for which the event loop did nothing else; `opening_late_s`: that until all vehicles
and faces are there. `hosts_cpu_percent`: of all hosts together.
"""

import asyncio
import gc
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
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
from m2pem.cli import NEW_OBJECTS
from m2pem.executive.executive import Executive
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager

PATIENCE_S = 120.0
LOOK_S = 0.01
READ = 10
READER = Path(__file__).with_name("ros_reader.py")


def udp_port() -> int:
    """One that is free now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def fleet_file(
    folder: Path, urls: Sequence[str], mavlink: int, ros: int, domain: int, hosts: int
) -> Path:
    """Vehicles v0, v1 and so on: first those of MAVLink."""
    vehicles: dict[str, dict[str, Any]] = {}
    for each in range(mavlink):
        connection = {"url": urls[each // PER_PORT], "system_id": address(each).system}
        vehicles[f"v{each}"] = {"arbiter": "mavlink", "connection": connection}
    for each in range(mavlink, mavlink + ros):
        connection = {"namespace": f"/v{each}", "domain_id": domain}
        vehicles[f"v{each}"] = {"arbiter": "ros", "connection": connection}
        if hosts:
            vehicles[f"v{each}"]["host"] = f"h{each % hosts}"
    text = {
        "version": 1,
        "name": "bench",
        "origin": {"lat": HOME[0], "lon": HOME[1], "alt": 0.0},
        "hosts": {
            f"h{each}": {"connect": [f"tcp/127.0.0.1:{free_port()}"]} for each in range(hosts)
        },
        "vehicles": {
            name: {"domain": "ground", "sitl": True, **each} for name, each in vehicles.items()
        },
    }
    path = folder / "fleet.yaml"  # JSON is YAML
    path.write_text(json.dumps(text), encoding="utf-8")
    return path


@contextmanager
def arbiter_hosts(file: Path, count: int) -> Iterator[list[int]]:
    """Those of a fleet; their process ids."""
    with ExitStack() as stack:
        started = []
        for each in range(count):
            command = (
                sys.executable,
                "-m",
                "m2pem",
                "arbiter-host",
                "--fleet",
                str(file),
                "--host",
                f"h{each}",
            )
            process = subprocess.Popen((*command, "--state", str(file.with_name(f"h{each}"))))
            stack.callback(process.wait)
            stack.callback(process.terminate)
            started.append(process.pid)
        yield started


def cpu_s(process: int) -> float:
    """What a process has used."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


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


class Lateness:
    """The longest time for which the event loop did nothing else, by a task that sleeps."""

    def __init__(self) -> None:
        self.longest_s = 0.0

    async def watch(self) -> None:
        """Until cancelled."""
        while True:
            before_s = time.perf_counter()
            await asyncio.sleep(LOOK_S)
            self.longest_s = max(self.longest_s, time.perf_counter() - before_s - LOOK_S)

    def begin(self) -> float:
        """Begin again; returns the longest time until now."""
        until_now_s, self.longest_s = self.longest_s, 0.0
        return until_now_s


def scrape(port: int) -> None:
    """Read /metrics."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics") as page:
        page.read()


async def measure(
    mavlink: int,
    ros: int,
    seconds: float,
    names: Sequence[str],
    domain: int,
    pipe: Connection,
    hosts: int,
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
        file = fleet_file(Path(scratch), urls, mavlink, ros, domain, hosts)
        served = stack.enter_context(arbiter_hosts(file, hosts))
        all_of_them = load_fleet(file)
        async with Executive(
            all_of_them, MemoryJournal(), PluginManager(), SystemClock()
        ) as running:
            pipe.send(ports)
            faces = [
                asyncio.create_task(face(name, running.control, settings[name]).serve())
                for name in names
            ]
            late = Lateness()
            watching = asyncio.create_task(late.watch())
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
            opening_late_s = late.begin()
            dropped = (await running.control.statistics()).telemetry_dropped
            hosts_before_s = sum(map(cpu_s, served))
            with watch:
                for _ in range(int(seconds)):
                    await asyncio.sleep(1)
                    if "prometheus" in names:
                        await asyncio.to_thread(scrape, metrics)
            after, lost_after = counted(urls)
            hosts_s = sum(map(cpu_s, served)) - hosts_before_s
            heard.end()
            late_s = late.begin()
            dropped = (await running.control.statistics()).telemetry_dropped - dropped
            watching.cancel()
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
        "opening_late_s": opening_late_s,
        "late_s": late_s,
        "cpu_percent": 100 * watch.cpu_s / watch.wall_s,
        "hosts_cpu_percent": 100 * hosts_s / watch.wall_s,
        "peak_mb": peak_kb() / 1024,
    }


def main() -> None:
    """The command."""
    mavlink, rate_hz, ros = map(int, sys.argv[1:4])
    ros_hz, seconds = map(float, sys.argv[4:6])
    names = [] if sys.argv[6] == "none" else sys.argv[6].split(",")
    hosts = int([*sys.argv, "0"][7])
    gc.set_threshold(NEW_OBJECTS)  # as in the command line
    rovers, pipe = started(mavlink, rate_hz)
    with own_domain() as domain, ExitStack() as stack:
        if ros:
            stack.enter_context(Vehicles(domain, ros, ros_hz, mavlink))
        answer = asyncio.run(measure(mavlink, ros, seconds, names, domain, pipe, hosts))
    rovers.join()
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
