"""Rounds in which a standby takes over: its owner is killed, stopped, blocked by a plugin, or cut
off from its database.

`python -m tests.chaos.takeovers [--rounds 200]` plays them in turn, on a journal in PostgreSQL, and
prints how long each take-over took.
"""

import argparse
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from statistics import quantiles

from m2pem.simulation.executions import Effect, EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.chaos.missions import FORK, process
from tests.command_line import BLOCKING, CommandLine, Program, install_plugin
from tests.executive.conftest import question, task
from tests.faults.tcp_proxy import TcpProxy
from tests.postgres_server import PostgresServer, start_server

LEASE_S = 2.0


class Fault(StrEnum):
    """What happens to the owner. After a kill the standby is on the same host, else on another."""

    KILLED = "killed"
    STOPPED = "stopped, goes on after the take-over"
    CUT_OFF = "cut off from its database, which is there again after the take-over"
    BLOCKED = "blocked by a plugin, and ends"


WITHIN_S = {each: 2.0 if each is Fault.KILLED else LEASE_S + 1.0 for each in Fault}
"""Each take-over is due, on a computer with much to do."""

_SIGNALS = {
    Fault.KILLED: signal.SIGKILL,
    Fault.STOPPED: signal.SIGSTOP,
    Fault.BLOCKED: signal.SIGUSR1,
}

_FLEET = """version: 1
name: takeovers
origin: {{lat: 38.1075, lon: -77.3192, alt: 60.0}}
vehicles:
  ugv1: {{domain: ground, arbiter: sim, connection: {{state: {state}, telemetry_hz: 1}}}}
"""
_FAR = '<m2pem:property name="target" value="[38.2000, -77.3192]"/>'
_ELEMENTS = FORK + task("Out", "vehicle='ugv1'", "goto", _FAR) + question("Ask")
_MISSION = process(_ELEMENTS, "S Fork Out Join E", "Fork Ask Join")


@dataclass(frozen=True, slots=True)
class Takeover:
    """From the fault, in seconds: until the standby serves, until it has claimed the run, and until
    an operator (`m2pem attach`, at the executive of its host) is served by it."""

    serves_s: float
    claimed_s: float
    attached_s: float


def play(fault: Fault, server: PostgresServer, folder: Path) -> Takeover:
    """Play a round.

    Raises:
        AssertionError: the standby did not take over in time, or the owner moved a vehicle later.
    """
    with ExitStack() as stack:
        m2pem = CommandLine(folder, {"M2PEM_LEASE_S": f"{LEASE_S:g}", **_with_plugin(folder)})
        stack.callback(m2pem.end)
        direct = server.new_database()
        proxy = TcpProxy(server.folder / ".s.PGSQL.5432")
        stack.callback(proxy.close)
        database = direct.partition("?")[0].rpartition("/")[2]
        through = f"postgresql://m2pem@127.0.0.1:{proxy.port}/{database}"
        elsewhere = folder / "elsewhere"
        elsewhere.mkdir()
        another = {"M2PEM_RUNTIME_DIR": str(elsewhere), "HOME": str(elsewhere)}
        here = {"M2PEM_RUNTIME_DIR": str(folder)}
        host = here if fault is Fault.KILLED else another
        journal = through if fault is Fault.KILLED else direct
        state, fleet, mission = (folder / each for each in ("state", "fleet.yaml", "m.bpmn"))
        fleet.write_text(_FLEET.format(state=state), encoding="utf-8")
        mission.write_bytes(_MISSION)
        words = ("serve", "--fleet", fleet, "--ocu", "none", "--format", "json", "--journal")
        owner = m2pem.start(*words, through, **here)
        owner.until_said("serving")
        standby = m2pem.start(*words, journal, "--standby", **host)
        standby.until_said("standing by")
        status, _, errors = m2pem.run("start", mission, "--journal", through, **here)
        assert status == 0, errors
        owner.until_record("BehaviorProgressed", state="RUNNING")
        attach = ("attach", "--ocu", "plain", "--journal", journal)
        attached = None
        if fault is Fault.KILLED:
            attached = m2pem.start(*attach, **host)
            attached.until_text("Ask")

        began_s = time.monotonic()
        _begin(fault, owner, proxy)
        standby.until_said("taking over")
        serves_s = time.monotonic() - began_s
        standby.until_record("RunClaimed", epoch=2)
        claimed_s = time.monotonic() - began_s
        if attached is not None:
            attached.until_said("has taken over")
        else:
            attached = m2pem.start(*attach, **host)
            attached.until_text("Ask")
        attached_s = time.monotonic() - began_s
        before = recorded_effects(state)
        _end(fault, owner, proxy, standby)
        _judge(fault, before, recorded_effects(state))
        status, _, errors = m2pem.run("stop", "r1", "--journal", journal, **host)
        assert status == 0, errors
        standby.until_record("RunEnded", outcome="stopped")
        assert serves_s < WITHIN_S[fault], f"it took {serves_s:.2f} s"
        return Takeover(serves_s, claimed_s, attached_s)


def _with_plugin(folder: Path) -> dict[str, str]:
    return install_plugin(folder, "blocking", BLOCKING)


def _begin(fault: Fault, owner: Program, proxy: TcpProxy) -> None:
    if fault is Fault.CUT_OFF:
        proxy.partitioned = True
    else:
        owner.send(_SIGNALS[fault])


def _end(fault: Fault, owner: Program, proxy: TcpProxy, standby: Program) -> None:
    """End the fault: the owner learns that it was replaced, and ends."""
    proxy.partitioned = False
    if fault is Fault.STOPPED:
        owner.send(signal.SIGCONT)
    status, errors = owner.rest()
    if fault is Fault.KILLED:
        return
    assert status == 1, (status, errors)
    assert ("has blocked it for" in errors) is (fault is Fault.BLOCKED), errors
    assert f"process {standby.process.pid} on" in errors, errors


def _judge(fault: Fault, before: list[Effect], after: list[Effect]) -> None:
    """The vehicle began once, was held where its owner was cut off, and nothing else moved it."""
    wanted = [EffectKind.START, *([EffectKind.HOLD] if fault is Fault.CUT_OFF else [])]
    kinds = [each.kind for each in before]
    assert kinds == wanted, before
    assert after == before, after[len(before) :]


def as_table(played: dict[Fault, list[Takeover]]) -> str:
    """Return the figures, in seconds, as a table of Markdown."""
    lines = ["| the owner is | rounds | p50 | p99 | most | operator served again: p50 | p99 |"]
    lines.append("|---|---|---|---|---|---|---|")
    for fault, each in played.items():
        parts = [
            _percentiles(each, read) for read in (lambda t: t.claimed_s, lambda t: t.attached_s)
        ]
        most = max(takeover.claimed_s for takeover in each)
        (p50, p99), (again50, again99) = parts
        lines.append(
            f"| {fault} | {len(each)} | {p50:.2f} | {p99:.2f} | {most:.2f} | {again50:.2f} |"
            f" {again99:.2f} |"
        )
    return "\n".join(lines)


def _percentiles(
    takeovers: list[Takeover], read: Callable[[Takeover], float]
) -> tuple[float, float]:
    times = [read(each) for each in takeovers]
    cuts = quantiles(times * 2 if len(times) == 1 else times, n=100, method="inclusive")
    return cuts[49], cuts[98]


def main() -> int:
    """Play rounds; 1 if one went wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos.takeovers", description=__doc__)
    parser.add_argument("--rounds", type=int, default=200)
    rounds: int = parser.parse_args().rounds
    server = start_server()
    played: dict[Fault, list[Takeover]] = defaultdict(list)
    wrong = 0
    try:
        for number in range(rounds):
            fault = list(Fault)[number % len(Fault)]
            with tempfile.TemporaryDirectory(prefix="m2pem-takeover-") as folder:
                try:
                    played[fault].append(play(fault, server, Path(folder)))
                except AssertionError as error:
                    wrong += 1
                    print(f"round {number + 1}: {fault}: {error}", flush=True)
            if (number + 1) % 20 == 0:
                print(f"\n{number + 1} rounds, {wrong} wrong\n{as_table(played)}", flush=True)
    finally:
        server.remove()
    print(f"\n{as_table(played)}\n\n{rounds} rounds; wrong: {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
