"""What an executive has done in processes of their own: verifying and rehearsing."""

import asyncio
import json
import os
import sys
import time
from collections.abc import Awaitable, Callable
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import jsonschema
import pytest

from m2pem.api.authoring import SearchLimits, SearchProgress
from m2pem.api.clock import SystemClock
from m2pem.errors import AnswersError, InternalError, MissionError, OperatorError
from m2pem.executive.control import Control
from m2pem.executive.executive import Executive
from m2pem.executive.subprocess_worker import run_in_subprocess
from m2pem.fleet.fleet import simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.journal import MemoryJournal
from m2pem.plugins import PluginManager
from m2pem.rehearsal.worker import rehearse_in_subprocess
from m2pem.verify.requirements.requirement import RequirementsError
from tests.cli.test_verify_terminal import tangled
from tests.console import run_preloaded

T = TypeVar("T")

REPOSITORY = Path(__file__).parents[2]
VIGNETTE = REPOSITORY / "missions" / "vignette1.bpmn"
FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"
SCHEMA = json.loads((REPOSITORY / "docs" / "verification.schema.json").read_text(encoding="utf-8"))
ENDLESS = """
import time
from m2pem.executive.subprocess_worker import serve
def work(order, tell):
    tell(str(__import__("os").getpid()).encode())
    time.sleep(600)
serve(work)
"""


def with_control(story: Callable[[Control], Awaitable[T]]) -> T:
    async def tell() -> T:
        executive = Executive(
            simulated_fleet(load_fleet(FLEET)),
            MemoryJournal(),
            PluginManager(),
            SystemClock(),
            rehearse=rehearse_in_subprocess,
        )
        async with executive:
            return await story(executive.control)

    return asyncio.run(tell())


def without_times(report: Any) -> Any:
    return {**report, "mission": "", "coverage": {**report["coverage"], "seconds": 0}}


# --- verify -------------------------------------------------------------------------------------


def test_verifying_gives_the_very_answers_of_the_command_line() -> None:
    told: list[SearchProgress] = []

    async def story(control: Control) -> Any:
        return await control.verify(VIGNETTE.read_bytes(), on_progress=told.append)

    found = with_control(story)
    words = ["verify", str(VIGNETTE), "--fleet", str(FLEET), "--format", "json"]
    said = run_preloaded(words, REPOSITORY, os.environ)
    assert said.returncode == 0, said.stdout
    assert without_times(found) == without_times(json.loads(said.stdout))
    jsonschema.validate(found, SCHEMA)
    assert found["verdict"] == "holds"
    assert all(each.seconds >= 0 for each in told)


def test_a_specification_timers_strictness_and_limits_are_handed_on() -> None:
    spec = 'requirements: [{id: never, ltl: "[] !active(Reverse)"}]'

    async def story(control: Control) -> Any:
        violated = await control.verify(VIGNETTE, spec=spec, strict=True, timers_in_order=True)
        cut = await control.verify(VIGNETTE, limits=SearchLimits(seconds=1e-9))
        sure = await control.verify(VIGNETTE, assume=["no-failures"], all_pools=True)
        return violated, cut, sure

    violated, cut, sure = with_control(story)
    jsonschema.validate(sure, SCHEMA)
    assert (sure["assumed"], sure["verdict"]) == ("no-failures", "holds")
    assert violated["verdict"] == "violated" and violated["strict"]
    assert "never" in [each["property"] for each in violated["violations"]]
    assert any("in the order of their times" in note for note in violated["coverage"]["notes"])
    assert cut["verdict"] == "undecided"


def test_progress_says_what_is_certain_already_and_what_the_search_needs() -> None:
    sent: list[SearchProgress] = []

    async def story(control: Control) -> Any:
        limits = SearchLimits(states=150_000, exhaustive=True)
        mission = tangled(handled=False).encode()
        return await control.verify(mission, limits=limits, on_progress=sent.append)

    found = with_control(story)
    assert found["coverage"]["states"] > 150_000, "it has gone on after the violation"
    last = sent[-1]
    assert last.decided["decisions-handled"] == "violated"
    assert last.decided["can-be-triggered"] == "holds"
    assert "no-livelock" not in last.decided
    assert last.states > 0
    assert last.memory_mb > 0


def test_what_cannot_be_verified_is_refused_with_its_findings() -> None:
    async def story(control: Control) -> Any:
        with pytest.raises(MissionError) as of_mission:
            await control.verify(VIGNETTE.read_bytes().replace(b'"evsg1"', b'"evsg9"'))
        with pytest.raises(RequirementsError) as of_spec:
            await control.verify(
                VIGNETTE, spec="requirements: [{id: a, ltl: '[] active(Nowhere)'}]"
            )
        return of_mission.value.findings, of_spec.value.findings

    of_mission, of_spec = with_control(story)
    assert any("evsg9" in each.message for each in of_mission)
    assert [each.file for each in of_spec] == ["requirements.yaml"]


# --- simulate -----------------------------------------------------------------------------------


def test_a_rehearsal_tells_where_the_vehicles_were_and_has_the_same_records() -> None:
    answers = (REPOSITORY / "missions/answers/vignette1_detection.yaml").read_bytes()

    async def story(control: Control) -> Any:
        plain = await control.simulate(VIGNETTE.read_bytes(), answers=answers)
        watched = await control.simulate(
            VIGNETTE.read_bytes(), answers=answers, telemetry_every_s=0.5
        )
        return plain, watched

    plain, watched = with_control(story)
    assert watched.records == plain.records and not plain.telemetry
    times = [each.t_s for each in watched.telemetry]
    assert times[:4] == [0, 0.5, 1, 1.5] and times[-1] == watched.records[-1].t_s
    places = [each.vehicles["evsg1"].position for each in watched.telemetry]
    steps_m = [
        111_000 * abs(after.latitude_deg - before.latitude_deg)
        for before, after in pairwise(places)
    ]
    assert places[0] != places[-1] and max(steps_m) < 5
    assert set(watched.telemetry[0].payloads) == {"evsg1/gpr", "evsg2/ptz"}


def test_answers_that_do_not_fit_are_refused_with_their_line() -> None:
    async def story(control: Control) -> Any:
        with pytest.raises(AnswersError) as refused:
            await control.simulate(VIGNETTE, answers=b"answers:\n  Nowhere: [yes]")
        with pytest.raises(OperatorError, match="telemetry_every_s"):
            await control.simulate(VIGNETTE, telemetry_every_s=0)
        return refused.value.findings

    assert [(each.file, each.line) for each in with_control(story)] == [("answers.yaml", 2)]


# --- processes ----------------------------------------------------------------------------------


@pytest.fixture
def endless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "endless_work.py").write_text(ENDLESS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    return "endless_work"


def ended(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    state = Path(f"/proc/{pid}/stat")
    return state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z"


def test_cancelling_ends_the_process(endless: str) -> None:
    pids: list[int] = []

    async def story() -> None:
        begun = asyncio.Event()

        def told(content: bytes) -> None:
            pids.append(int(content))
            begun.set()

        task = asyncio.ensure_future(run_in_subprocess(endless, b"", told))
        await begun.wait()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert ended(pids[0])

    asyncio.run(story())


def test_the_process_ends_with_an_executive_that_is_killed(endless: str) -> None:
    script = (
        "import asyncio, os\n"
        "from m2pem.executive.subprocess_worker import run_in_subprocess\n"
        "def told(content):\n"
        "    print(content.decode(), flush=True)\n"
        "    os._exit(9)\n"
        f"asyncio.run(run_in_subprocess({endless!r}, b'', told))\n"
    )

    async def story() -> int:
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-c",
            script,
            stdout=asyncio.subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        said, _ = await process.communicate()
        return int(said)

    pid = asyncio.run(story())
    deadline = time.monotonic() + 20
    while not ended(pid):
        assert time.monotonic() < deadline
        os.sched_yield()


def test_a_worker_that_breaks_off_is_an_error_and_its_last_words_are_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "broken_work.py").write_text("raise SystemExit('no room')", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InternalError) as broke:
        asyncio.run(run_in_subprocess("broken_work", b""))
    assert (
        str(broke.value) == "broken_work broke off with status 1; the log of the executive says why"
    )
    assert "no room" in caplog.text
