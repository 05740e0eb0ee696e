"""A second executive on the journal takes over the runs of one that is killed, or stands still."""

import json
import signal
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

import pytest

from m2pem.simulation.executions import EffectKind
from m2pem.simulation.state_file import recorded_effects
from tests.command_line import (
    BLOCKING,
    MISSION,
    CommandLine,
    Program,
    Record,
    fleet_with_state,
    install_plugin,
)
from tests.faults.tcp_proxy import TcpProxy
from tests.postgres_server import PostgresServer, postgres, postgres_url
from tests.terminal import Terminal

__all__ = ["postgres", "postgres_url"]

LEASE = {"M2PEM_LEASE_S": "2"}


@pytest.fixture(params=["sqlite", "postgresql"])
def journal(request: pytest.FixtureRequest) -> str:
    if request.param == "sqlite":
        return "journal.db"
    url: str = request.getfixturevalue("postgres_url")
    return url


def serve(
    m2pem: CommandLine, fleet: Path, journal: str, *words: str, **environment: str
) -> Program:
    return m2pem.start(
        "serve", "--fleet", fleet, "--ocu", "none", "--format", "json", "--journal", journal,
        *words, **{**LEASE, **environment},
    )  # fmt: skip


def start_mission(m2pem: CommandLine, journal: str) -> None:
    status, _, errors = m2pem.run("start", MISSION, "--journal", journal)
    assert (status, errors) == (0, "")


def answer(m2pem: CommandLine, journal: str, prompt: str, decision: str) -> None:
    status, _, errors = m2pem.run("answer", "r1", prompt, decision, "--journal", journal)
    assert status == 0, errors


def prompted(program: Program) -> str:
    found: str = program.until_record("PromptOpened")["prompt"]
    return found


def assert_each_behavior_began_once(state: Path, records: list[Record]) -> None:
    starts = Counter(
        effect.behavior for effect in recorded_effects(state) if effect.kind is EffectKind.START
    )
    requested = [each["behavior"] for each in records if each["record"] == "BehaviorRequested"]
    assert requested
    assert starts == Counter(requested)


def test_a_standby_takes_over_from_a_killed_executive(
    m2pem: CommandLine, tmp_path: Path, journal: str
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, journal)
    owner.until_said("serving")
    standbys = [serve(m2pem, fleet, journal, "--standby") for _ in range(2)]
    for each in standbys:
        assert f"process {owner.process.pid} on" in each.until_said("standing by for")
    start_mission(m2pem, journal)
    answer(m2pem, journal, prompted(owner), "continue")
    owner.until_record("BehaviorProgressed", state="RUNNING")
    _, out, _ = m2pem.run("doctor", "--running", "--journal", journal)
    assert all(f"process {each.process.pid} on" in out for each in standbys), out
    owner.kill()
    again, other = who_took_over(standbys, owner)
    again.until_record("RunClaimed", epoch=2)
    status, _, errors = m2pem.run("stop", "r1", "--journal", journal)
    assert status == 0, errors
    again.until_record("RunEnded", outcome="stopped")
    status, out, _ = m2pem.run("replay", "r1", "--format", "json", "--journal", journal)
    assert_each_behavior_began_once(state, [json.loads(line) for line in out.splitlines()])
    assert m2pem.run("replay", "r1", "--verify", "--journal", journal)[0] == 0
    again.send(signal.SIGTERM)
    assert again.rest()[0] == 0
    other.until_said("serving")  # nothing is left to take over: it serves
    other.send(signal.SIGTERM)
    assert other.rest()[0] == 0


def who_took_over(standbys: list[Program], before: Program) -> tuple[Program, Program]:
    """The standby that serves now, and the one that stands by for it."""
    said = {}
    for each in standbys:
        for line in each.stderr:
            named = f"process {before.process.pid} on" in line or "just begun" in line
            if not named:
                said[each.process.pid] = line
                break
    (again,) = (each for each in standbys if "taking over" in said[each.process.pid])
    (other,) = (each for each in standbys if each is not again)
    assert f"process {again.process.pid} on" in said[other.process.pid]
    again.until_said("serving")
    return again, other


def test_an_executive_that_stood_still_moves_nothing_after_it_was_replaced(
    m2pem: CommandLine, tmp_path: Path, postgres_url: str
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, postgres_url)
    owner.until_said("serving")
    # As on another host: on this one the kernel keeps the locks of a process that stands still.
    elsewhere = {"M2PEM_RUNTIME_DIR": str(tmp_path / "elsewhere")}
    standby = serve(m2pem, fleet, postgres_url, "--standby", **elsewhere)
    standby.until_said("standing by for")
    start_mission(m2pem, postgres_url)
    answer(m2pem, postgres_url, prompted(owner), "continue")
    owner.until_record("BehaviorProgressed", state="RUNNING")
    owner.send(signal.SIGSTOP)
    try:
        standby.until_said("taking over")  # when the lease has ended
        standby.until_record("RunClaimed", epoch=2)
        before = recorded_effects(state)
    finally:
        owner.send(signal.SIGCONT)
    status, errors = owner.rest()
    assert status == 1, errors
    assert f"process {standby.process.pid} on" in errors
    assert "this executive commands no vehicle any more" in errors
    sent = [each.kind for each in recorded_effects(state)[len(before) :]]
    assert EffectKind.CANCEL not in sent
    status, _, errors = m2pem.run("stop", "r1", "--journal", postgres_url)
    assert status == 0, errors
    standby.until_record("RunEnded", outcome="stopped")
    status, out, _ = m2pem.run("replay", "r1", "--format", "json", "--journal", postgres_url)
    assert_each_behavior_began_once(state, [json.loads(line) for line in out.splitlines()])


@pytest.mark.parametrize(("lease_s", "over"), [(2, True), (9, False)])
def test_a_standby_takes_over_what_its_executive_holds_when_the_database_is_back(
    m2pem: CommandLine, tmp_path: Path, postgres: PostgresServer, lease_s: int, over: bool
) -> None:
    """`over`: the whole lease has passed; the old executive then reaches the database first."""
    fleet, state = fleet_with_state(tmp_path)
    direct = postgres.new_database()
    lease = {"M2PEM_LEASE_S": str(lease_s)}
    elsewhere = {"M2PEM_RUNTIME_DIR": str(tmp_path / "elsewhere"), **lease}
    with ExitStack() as stack:
        proxies = [TcpProxy(postgres.folder / ".s.PGSQL.5432") for _ in range(2)]
        for each in proxies:
            stack.callback(each.close)
        here, there = proxies
        database = direct.partition("?")[0].rpartition("/")[2]
        journal, other = (f"postgresql://m2pem@127.0.0.1:{p.port}/{database}" for p in proxies)
        owner = serve(m2pem, fleet, journal, **lease)
        owner.until_said("serving")
        standby = serve(m2pem, fleet, other, "--standby", **elsewhere)
        standby.until_said("standing by for")
        start_mission(m2pem, journal)
        answer(m2pem, journal, prompted(owner), "continue")
        owner.until_record("BehaviorProgressed", state="RUNNING")
        served = "SELECT executive FROM fleets WHERE fleet = 'mehds-vignette-1'"
        before = postgres.execute(served, direct)
        here.partitioned, there.partitioned = True, over
        owner.until_said("did not renew the lease" if over else "held: ")
        here.partitioned = False
        if over:
            while owner.process.poll() is None:
                if postgres.execute(served, direct) not in ([], before):
                    break
        there.partitioned = False
        status, errors = owner.rest()
        assert status == 1, errors
        assert f"process {standby.process.pid} on" in errors
        standby.until_record("RunClaimed", epoch=2)
        assert standby.until_record("PromptOpened")["prompt"]
        assert recorded_effects(state)[-1].kind is EffectKind.HOLD


def test_an_executive_that_a_plugin_blocks_leaves_its_missions_to_a_standby(
    m2pem: CommandLine, tmp_path: Path, journal: str
) -> None:
    fleet, state = fleet_with_state(tmp_path)
    plugin = install_plugin(tmp_path, "blocking", BLOCKING)
    owner = serve(m2pem, fleet, journal, **plugin)
    owner.until_said("serving")
    standby = serve(m2pem, fleet, journal, "--standby")
    standby.until_said("standing by for")
    start_mission(m2pem, journal)
    answer(m2pem, journal, prompted(owner), "continue")
    owner.until_record("BehaviorProgressed", state="RUNNING")
    owner.send(signal.SIGUSR1)
    status, errors = owner.rest()
    assert status == 1, errors
    assert "m2pem_plugin_blocking, block, line 6 has blocked it for" in errors
    assert f"leaves its missions to process {standby.process.pid} on" in errors
    standby.until_record("RunClaimed", epoch=2)
    status, _, errors = m2pem.run("stop", "r1", "--journal", journal)
    assert status == 0, errors
    standby.until_record("RunEnded", outcome="stopped")
    assert recorded_effects(state)[-1].kind in (EffectKind.CANCEL, EffectKind.END)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--journal", "memory:"), "a journal in memory ends with its executive"),
        (("--journal", "journal.db"), "serves another fleet with the name mehds-vignette-1"),
    ],
)
def test_a_standby_that_could_take_nothing_over_is_refused(
    m2pem: CommandLine, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, "journal.db")
    owner.until_said("serving")
    other = fleet.with_name("other.yaml")
    other.write_text(fleet.read_text().replace("max_outage: 10 min", "max_outage: 9 min"))
    status, _, errors = m2pem.run(
        "serve", "--standby", "--fleet", other, "--ocu", "none", *words
    )  # fmt: skip
    assert status == 2
    assert said in errors


@pytest.mark.long
def test_an_executive_that_ends_itself_leaves_the_terminal_as_it_was(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    words = ("serve", "--fleet", fleet, "--journal", "journal.db")
    plugin = install_plugin(tmp_path, "blocking", BLOCKING)
    with Terminal(tmp_path, *words, "--ocu", "terminal", **plugin) as owner:
        owner.until("no mission is running")
        standby = serve(m2pem, fleet, "journal.db", "--standby")
        standby.until_said("standing by for")
        owner.process.send_signal(signal.SIGUSR1)
        owner.until(r"\x1b\[\?1049l(?s:.*) leaves its missions to process")
        assert owner.process.wait() == 1


ANOTHER_HOST = """
import socket

socket.gethostname = lambda: "gcs2"
"""
"""A plugin by which an executive of this host is one of another host."""


@pytest.mark.long
def test_an_attached_operator_reads_where_another_host_has_taken_over(
    m2pem: CommandLine, tmp_path: Path, postgres_url: str
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, postgres_url)
    owner.until_said("serving")
    home = tmp_path / "there"
    home.mkdir()
    there = {"M2PEM_RUNTIME_DIR": str(home), "HOME": str(home)}
    plugin = install_plugin(home, "gcs2", ANOTHER_HOST)
    # Plugins are loaded before the journal is opened where an operator unit is.
    words = ("--standby", "--ocu", "plain")
    standby = serve(m2pem, fleet, postgres_url, *words, **there, **plugin)
    standby.until_said("standing by for")
    attached = m2pem.start("attach", "--ocu", "plain", "--journal", postgres_url, **LEASE)
    attached.until_said("attached to process")
    owner.send(signal.SIGSTOP)
    status, errors = attached.rest()
    assert status == 1
    gone = f"process {owner.process.pid} does not serve mehds-vignette-1 any more. gcs2 serves it"
    assert f"{gone} now (process {standby.process.pid}: m2pem serve" in errors
    assert "run `m2pem attach` there" in errors


@pytest.mark.long
def test_an_attached_operator_reads_that_the_executive_is_silent(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, "journal.db")
    owner.until_said("serving")
    standby = serve(m2pem, fleet, "journal.db", "--standby")
    standby.until_said("standing by for")
    attached = m2pem.start("attach", "--ocu", "plain", "--journal", "journal.db")
    attached.until_said(f"process {standby.process.pid} on")
    owner.send(signal.SIGSTOP)
    said = attached.until_said("does not answer: STOP from here reaches no vehicle")
    assert f"`kill -9 {owner.process.pid}` lets process {standby.process.pid} on" in said
    owner.send(signal.SIGCONT)
    attached.until_said(f"process {owner.process.pid} answers again")
    owner.send(signal.SIGSTOP)
    attached.until_said("does not answer")
    owner.kill()
    attached.until_said(f"process {standby.process.pid} has taken over")


def test_an_attached_operator_reads_that_no_executive_has_taken_over(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, "journal.db")
    owner.until_said("serving")
    start_mission(m2pem, "journal.db")
    prompted(owner)
    attached = m2pem.start("attach", "--ocu", "plain", "--journal", "journal.db")
    attached.until_text("[p1] UserSendRoute")
    owner.send(signal.SIGKILL)
    assert "STOP from here reaches no vehicle" in attached.until_said("no other one has taken over")
    next_one = serve(m2pem, fleet, "journal.db")
    attached.until_said(f"process {next_one.process.pid} has taken over")


def test_an_attached_operator_goes_on_at_the_executive_that_has_taken_over(
    m2pem: CommandLine, tmp_path: Path
) -> None:
    fleet, _ = fleet_with_state(tmp_path)
    owner = serve(m2pem, fleet, "journal.db")
    owner.until_said("serving")
    standby = serve(m2pem, fleet, "journal.db", "--standby")
    standby.until_said("standing by for")
    start_mission(m2pem, "journal.db")
    prompted(owner)
    attached = m2pem.start("attach", "--ocu", "plain", "--journal", "journal.db")
    attached.until_text("[p1] UserSendRoute")
    owner.kill()
    assert f"process {standby.process.pid} has taken over" in attached.until_said("taken over")
    attached.until_text("[p1] UserSendRoute")
    attached.type("abort")
    standby.until_record("RunEnded", outcome="terminated")
