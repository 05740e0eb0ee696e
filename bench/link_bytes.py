"""Bytes a second on the link to the same two rovers, by Zenoh, by MAVLink and by DDS.

    python -m bench.link_bytes [SECONDS]

The executive and the rovers are in two network namespaces, so that it needs root (bench.network).
Counted are IP packets with their headers, in both directions, for SECONDS (20) at rest and then
under way. By Zenoh, the arbiter is on the rovers' side, over TLS, and sends states at 4 Hz; what it
says to the rovers is not on the link. By DDS (Fast DDS, where `make ros` was), the rovers publish
odometry and status at 4 Hz, and stand still.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from bench.__main__ import ros_python
from bench.network import Link, Network, make_keys, missing

NEAR, FAR = "station", "vehicles"
M2PEM = (sys.executable, "-m", "m2pem")
SETTLED_S = 8
"""After so long all has been found and nothing is asked for any more."""

LATITUDE, LONGITUDE = 47.397742, 8.545594
APART_M = 5.0
PORT, DOMAIN, RATE_HZ = 14600, 7, 4.0
ROVERS = ("v0", "v1")
HEAD = f"version: 1\nname: bench\norigin: {{lat: {LATITUDE}, lon: {LONGITUDE}, alt: 488.0}}\n"


@dataclass(frozen=True, slots=True)
class Far:
    """What is at the far end. `fleet`: of the executive. `commands`: run there. `environment`: of
    these and the executive. `python`: of the executive."""

    fleet: str
    commands: Sequence[Sequence[str]]
    environment: dict[str, str]
    python: str = sys.executable


def _vehicles(arbiter: str, more: str, *connections: str) -> str:
    lines = (
        f"  {name}: {{domain: ground, arbiter: {arbiter}, {more}connection: {{{each}}}}}\n"
        for name, each in zip(ROVERS, connections, strict=True)
    )
    return "vehicles:\n" + "".join(lines)


def _mavlink_rovers(address: str) -> tuple[Sequence[str], tuple[str, ...]]:
    """The command of two simulated rovers at an address, and how each is connected."""
    command = (
        *(*M2PEM, "sim", "mavlink", "--rovers", "2", "--ekf", "1s"),
        *("--listen", f"udp://{address}:{PORT}", "--home", f"{LATITUDE},{LONGITUDE},488"),
    )
    urls = (f"url: 'udpout://{address}:{PORT + number}'" for number in range(2))
    return command, tuple(f"{url}, system_id: {1 + number}" for number, url in enumerate(urls))


def by_mavlink(network: Network, folder: Path) -> Far:
    """The executive has the arbiter, and MAVLink goes over the link."""
    command, connections = _mavlink_rovers(network.address(FAR))
    return Far(HEAD + _vehicles("mavlink", "", *connections), [command], {})


def by_zenoh(network: Network, folder: Path) -> Far:
    """The arbiter is at the far end, and Zenoh goes over the link."""
    command, connections = _mavlink_rovers("127.0.0.1")
    make_keys(folder, network.address(FAR))
    tls = "tls: {ca: ca.pem, certificate: link.pem, key: link.key}"
    host = f"hosts:\n  pi: {{connect: ['tls/{network.address(FAR)}:7447'], {tls}}}\n"
    fleet = HEAD + host + _vehicles("mavlink", "host: pi, ", *connections)
    serving = (*M2PEM, "arbiter-host", "--fleet", "fleet.yaml", "--state", "state")
    return Far(fleet, [command, serving], {})


def by_dds(network: Network, folder: Path) -> Far:
    """The rovers are nodes of ROS, and DDS goes over the link."""
    python = ros_python(only_own=False)
    from_loopback = Path("plugins/arbiters/ros/m2pem_plugin_ros/loopback.xml").read_text()
    environment = {}
    for name in (NEAR, FAR):
        profile = folder / f"{name}.xml"
        profile.write_text(from_loopback.replace("127.0.0.1", network.address(name)))
        environment[name] = str(profile)
    vehicles = str(Path("bench/programs/ros_vehicles.py").resolve())
    connections = (f"namespace: /{name}, domain_id: {DOMAIN}" for name in ROVERS)
    return Far(
        HEAD + _vehicles("ros", "", *connections),
        [(python, vehicles, "2", str(RATE_HZ), "0", "endless")],
        {
            "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
            "ROS_DOMAIN_ID": str(DOMAIN),
            **{f"PROFILE_OF_{name}": file for name, file in environment.items()},
        },
        python,
    )


WAYS: dict[str, Callable[[Network, Path], Far]] = {
    "Zenoh": by_zenoh,
    "MAVLink": by_mavlink,
    "DDS": by_dds,
}


def mission(rest_s: float) -> str:
    """Rest for so long, then drive with both."""
    tasks = flows = ""
    for number, name in enumerate(ROVERS):
        target = f"[{LATITUDE + 0.01}, {LONGITUDE + 0.001 * number}]"
        tasks += (
            f'<scriptTask id="{name}"><extensionElements><m2pem:behavior type="vehicle"'
            f' name="goto"><m2pem:properties><m2pem:property name="target" value="{target}"/>'
            '</m2pem:properties><m2pem:resources><m2pem:role name="driver"'
            f' vehicle="{name}"/></m2pem:resources></m2pem:behavior></extensionElements>'
            "</scriptTask>"
        )
        flows += f'<sequenceFlow id="to{name}" sourceRef="Fork" targetRef="{name}"/>'
    return (
        '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="bench"'
        ' xmlns:m2pem="https://m2pem.org/schema/1"><process id="P" isExecutable="true">'
        '<startEvent id="S"/><intermediateCatchEvent id="Rest"><timerEventDefinition>'
        f"<timeDuration>PT{rest_s:g}S</timeDuration></timerEventDefinition>"
        f'</intermediateCatchEvent><parallelGateway id="Fork"/>{tasks}{flows}'
        '<sequenceFlow id="a" sourceRef="S" targetRef="Rest"/>'
        '<sequenceFlow id="b" sourceRef="Rest" targetRef="Fork"/></process></definitions>'
    )


@contextmanager
def program(
    network: Network, where: str, words: Sequence[str], folder: Path, far: Far
) -> Iterator["subprocess.Popen[str]"]:
    """A program on a host, killed at the end of the block."""
    environment = {**os.environ, **far.environment, "HOME": str(folder), "PYTHONUNBUFFERED": "1"}
    if profile := far.environment.get(f"PROFILE_OF_{where}"):
        environment["FASTRTPS_DEFAULT_PROFILES_FILE"] = profile
        environment["FASTDDS_DEFAULT_PROFILES_FILE"] = profile
    with (
        (folder / f"{where}.err").open("a") as errors,
        subprocess.Popen(
            [*network.inside(where), *words],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        ) as process,
    ):
        try:
            yield process
        finally:
            process.kill()


def counted(link: Link, seconds: float) -> dict[str, float]:
    """Count for so long; returns bytes a second by the host that sent them."""
    before = dict(link.carried)
    time.sleep(seconds)
    return {name: (link.carried[name] - before.get(name, 0)) / seconds for name in (NEAR, FAR)}


def measure(way: str, seconds: float, folder: Path) -> list[dict[str, float]]:
    """Return bytes a second at rest, and under way.

    Raises:
        RuntimeError: the rovers were not under way.
    """
    with Network(NEAR, FAR) as network, ExitStack() as stack:
        far = WAYS[way](network, folder)
        (folder / "fleet.yaml").write_text(far.fleet)
        (folder / "m.bpmn").write_text(mission(SETTLED_S + seconds + 2))
        for words in far.commands:
            stack.enter_context(program(network, FAR, words, folder, far))
        words = (far.python, "-m", "m2pem", "run", "m.bpmn", "--fleet", "fleet.yaml")
        options = ("--ocu", "none", "--format", "json", "--journal", "journal.db")
        executive = stack.enter_context(program(network, NEAR, (*words, *options), folder, far))
        assert executive.stdout is not None
        link = network.link(NEAR, FAR)
        found = []
        running = 0
        for line in executive.stdout:
            record = json.loads(line)
            if record["record"] == "EventAwaited":
                time.sleep(SETTLED_S)
                found.append(counted(link, seconds))
            if record["record"] == "BehaviorProgressed" and record["state"] == "RUNNING":
                running += 1
                if running == len(ROVERS):
                    time.sleep(1)
                    return [*found, counted(link, seconds)]
    said = "".join((folder / f"{name}.err").read_text() for name in (NEAR, FAR))
    raise RuntimeError(f"{way}: the rovers were not under way: {said}")


def main(words: Sequence[str]) -> int:
    """The command."""
    if missing():
        print(f"bench: {missing()}", file=sys.stderr)
        return 2
    seconds = float(words[0]) if words else 20.0
    print("| bytes/s, both ways together | at rest | under way | of it from the executive |")
    print("|---|---|---|---|")
    for way in words[1:] or WAYS:
        if way == "DDS" and not ros_python(only_own=False):
            print("bench: ROS is not installed here, and DDS is left out", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            rest, moving = measure(way, seconds, Path(folder))
        cells = (sum(rest.values()), sum(moving.values()), moving[NEAR])
        print(f"| {way} | " + " | ".join(f"{round(each):,}" for each in cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
