"""Hosts with networks of their own, and links between them that lose, delay and stop packets.

A host is a network namespace of Linux with one TUN device. A thread of this process carries packets
from device to device: what TCP or UDP does on such a link is the kernel's own. Addresses are
private, and no way leads out of the namespaces. Needs root, iproute2 and util-linux.
"""

import fcntl
import heapq
import math
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

TUN = Path("/dev/net/tun")
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
DEVICE = "link0"
QUEUE_BYTES = 16_000
"""Of each direction of a link with a bound: what does not fit is lost, as in a radio."""

NEW_HOST = (
    *("unshare", "--net", "sh", "-c"),
    "for each in all default; do echo 1 > /proc/sys/net/ipv6/conf/$each/disable_ipv6; done;"
    "ip link set lo up; echo ready; exec cat",
)
"""Lives until its standard input is closed, also by the death of this process."""


def missing() -> str:
    """Return why there can be no such networks here; "": there can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if not TUN.exists():
        return f"there is no {TUN}"
    absent = [each for each in ("ip", "nsenter", "unshare") if not shutil.which(each)]
    return f"not installed: {', '.join(absent)}" if absent else ""


def make_keys(folder: Path, *addresses: str) -> Path:
    """Make a CA ("ca.pem"), a certificate for addresses ("link.pem") and its key, and "stranger",
    which another CA has signed; returns the folder.

    Raises:
        RuntimeError: openssl is not installed.
    """
    if not shutil.which("openssl"):
        raise RuntimeError("needs openssl: install it")
    names = ",".join(f"IP:{each}" for each in addresses)
    (folder / "names").write_text(f"subjectAltName={names}")

    def run(command: str) -> None:
        subprocess.run(command.split(), cwd=folder, check=True, capture_output=True)

    new = "openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes"
    for ca in ("ca", "other"):
        run(f"{new} -x509 -days 2 -keyout {ca}.key -out {ca}.pem -subj /CN={ca}")
    for name, ca in (("link", "ca"), ("stranger", "other")):
        run(f"{new} -keyout {name}.key -out {name}.csr -subj /CN={name}")
        signed = f"-CA {ca}.pem -CAkey {ca}.key -CAcreateserial -days 2 -extfile names"
        run(f"openssl x509 -req -in {name}.csr {signed} -out {name}.pem")
    for file in folder.iterdir():
        file.chmod(0o600)
    return folder


@dataclass
class Link:
    """The way between two hosts, alike in both directions. It may be changed at any time.

    `loss`: the share of packets that get lost. `delay_s`: of each way. `cut`: everything is lost.
    `carried`: bytes of IP packets that have arrived, by the host that sent them.
    """

    loss: float = 0.0
    delay_s: float = 0.0
    bits_per_s: float = math.inf
    cut: bool = False
    carried: "Counter[str]" = field(default_factory=Counter)
    free_at_s: dict[str, float] = field(default_factory=dict)

    def arrives_s(self, sender: str, size: int, chance: float) -> float:
        """Return when a packet that is sent now arrives; infinite: it gets lost."""
        now_s = time.monotonic()
        begins_s = max(now_s, self.free_at_s.get(sender, 0.0))
        full = (begins_s - now_s) * self.bits_per_s > 8 * QUEUE_BYTES
        if self.cut or chance < self.loss or full:
            return math.inf
        self.free_at_s[sender] = begins_s + 8 * size / self.bits_per_s
        self.carried[sender] += size
        return self.free_at_s[sender] + self.delay_s


class Network:
    """Hosts, each of which reaches each other one. `seed`: of what gets lost.

    Raises:
        RuntimeError: there can be no such networks here.
    """

    def __init__(self, *hosts: str, seed: int = 1) -> None:
        if why := missing():
            raise RuntimeError(why)
        self._names = hosts
        self._links = {
            frozenset((one, other)): Link()
            for index, one in enumerate(hosts)
            for other in hosts[:index]
        }
        self._random = random.Random(seed)
        self._holders: dict[str, subprocess.Popen[bytes]] = {}
        self._devices: dict[str, int] = {}
        self._ended = os.pipe()
        self._thread = threading.Thread(target=self._carry, name="network", daemon=True)

    def __enter__(self) -> "Network":
        for name in self._names:
            self._add(name)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.write(self._ended[1], b"\0")
        self._thread.join()
        for file in (*self._devices.values(), *self._ended):
            os.close(file)
        for holder in self._holders.values():
            holder.communicate()

    def address(self, host: str) -> str:
        """Return the address of a host."""
        return f"10.77.0.{self._names.index(host) + 1}"

    def inside(self, host: str) -> Sequence[str]:
        """Return the words before a command that is to run on a host."""
        return ("nsenter", "--target", str(self._holders[host].pid), "--net", "--")

    def link(self, one: str, other: str) -> Link:
        """Return the link between two hosts."""
        return self._links[frozenset((one, other))]

    def _add(self, name: str) -> None:
        holder = subprocess.Popen(NEW_HOST, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._holders[name] = holder
        assert holder.stdout is not None
        if holder.stdout.readline() != b"ready\n":
            raise RuntimeError(f"a network namespace for {name} could not be made")
        device = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
        self._devices[name] = device
        # The device gets a name that no other has here, before it is moved into the namespace.
        first = f"m{os.getpid()}n{len(self._devices)}"
        flags = IFF_TUN | IFF_NO_PI
        fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH22x", first.encode(), flags))
        _run("ip", "link", "set", first, "netns", str(holder.pid), "name", DEVICE)
        inside, address = self.inside(name), f"{self.address(name)}/24"
        _run(*inside, "ip", "address", "add", address, "dev", DEVICE)
        _run(*inside, "ip", "link", "set", DEVICE, "up")

    def _targets(self, address: bytes, sender: str) -> Sequence[str]:
        """Return the hosts that an address means: all others where it is one of multicast."""
        others = [each for each in self._names if each != sender]
        if 224 <= address[0] < 240:
            return others
        text = ".".join(map(str, address))
        return [each for each in others if self.address(each) == text]

    def _carry(self) -> None:
        """Carry packets until the end."""
        names = {device: name for name, device in self._devices.items()}
        waiting: list[tuple[float, int, int, bytes]] = []
        count = 0
        while True:
            wait_s = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
            ready, _, _ = select.select([*names, self._ended[0]], [], [], wait_s)
            if self._ended[0] in ready:
                return
            for device in ready:
                with suppress(BlockingIOError):
                    packet = os.read(device, 65_536)
                    for target in self._targets(packet[16:20], names[device]):
                        link = self.link(names[device], target)
                        at_s = link.arrives_s(names[device], len(packet), self._random.random())
                        if at_s < math.inf:
                            count += 1
                            to = self._devices[target]
                            heapq.heappush(waiting, (at_s, count, to, packet))
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, to, packet = heapq.heappop(waiting)
                with suppress(BlockingIOError):
                    os.write(to, packet)


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True)
