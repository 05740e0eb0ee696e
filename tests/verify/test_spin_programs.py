"""Spin, the compiler and the checker: what they print, how they end, and what is missing."""

import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

from m2pem.errors import InternalError
from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.net.simplify import simplify
from m2pem.verify.search.explore import Limits, Progress, Stopped
from m2pem.verify.spin import programs, queries
from m2pem.verify.spin.programs import SpinMissingError, Tools
from m2pem.verify.spin.queries import CutReason, ErrorKind, Storage, read
from m2pem.verify.spin.search import search
from m2pem.verify.spin.trail import Trail, replay
from m2pem.verify.spin.trail import read as read_trail
from m2pem.verify.translate import translate
from tests.verify.models import branches

WHOLE = """
(Spin Version 6.5.2 -- 6 December 2019)

Full statespace search for:
State-vector 20 byte, depth reached 92, errors: 0
       35 states, stored
       12 states, matched
       47 transitions (= stored+matched)
unreached in proctype mission
	mission.pml:54, state 45, "D_STEP54"
	mission.pml:69, state 161, "D_STEP69"
	mission.pml:105, state 831, "(1)"

pan: elapsed time 0 seconds
"""


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the programs' folders are made; it must be empty in the end."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def rows(count: int) -> PetriNet:
    """4 ** count states, about."""
    return simplify(translate(branches(count)))


# --- what a checker prints ------------------------------------------------------------------------


def test_a_whole_search_is_read() -> None:
    report = read(WHOLE)
    assert (report.states, report.transitions, report.errors) == (35, 47, 0)
    assert report.found is None
    assert report.cut is None
    assert report.unreached == {54, 69}
    assert report.unreached_skips == {105}


@pytest.mark.parametrize(
    ("line", "cut"),
    [
        ("error: max search depth too small", CutReason.DEPTH),
        ("pan: reached -DMEMLIM bound", CutReason.MEMORY),
        ("pan: out of memory", CutReason.MEMORY),
        ("Warning: Search not completed", CutReason.UNFINISHED),
    ],
)
def test_no_errors_found_is_no_proof_when_the_search_was_cut_short(
    line: str, cut: CutReason
) -> None:
    assert read(f"{line}\n{WHOLE}").cut is cut


def test_an_error_is_told_from_how_its_search_ended() -> None:
    text = (
        "pan:1: assertion violated (at_x<=0) (at depth 7)\npan: wrote mission.pml.trail\n"
        f"Warning: Search not completed\n{WHOLE.replace('errors: 0', 'errors: 1')}"
    )
    report = read(text)
    assert (report.found, report.assertion, report.cut) == (ErrorKind.ASSERTION, "(at_x<=0)", None)
    cycle = text.replace("assertion violated (at_x<=0)", "acceptance cycle")
    assert read(cycle).found is ErrorKind.CYCLE


@pytest.mark.parametrize(
    "text",
    [
        "",
        "Segmentation fault",
        WHOLE.replace("errors: 0", "errors: 1"),
        f"pan: error, VECTORSZ too small, recompile pan.c\n{WHOLE}",
        f"pan:1: invalid end state (at depth 3)\n{WHOLE}",
    ],
)
def test_what_is_not_understood_is_no_answer(text: str) -> None:
    with pytest.raises(InternalError):
        read(text)


def test_large_numbers_are_read() -> None:
    assert read(WHOLE.replace("35 states", "1.2345679e+08 states")).states == 123_456_790


# --- trails ---------------------------------------------------------------------------------------


def _step(number: int, line: int, what: str) -> str:
    return f" {number:2}:\tproc  0 (mission:1) mission.pml:{line} (state {number})\t[{what}]"


def test_a_transition_that_fires_twice_in_a_row_is_told_twice() -> None:
    lines = [
        _step(1, 10, "(at_a)"),
        _step(2, 10, "at_a = 0"),
        _step(2, 4, "at_b = 0"),
        _step(3, 40, ".(goto)"),
        _step(4, 10, "(at_a)"),
        _step(5, 10, "at_a = 0"),
    ]
    assert read_trail("\n".join(lines), {10: 7}) == Trail((7, 7))


def test_a_cycle_may_begin_in_the_midst_of_a_transition() -> None:
    lines = [
        _step(1, 10, "(at_a)"),
        _step(2, 10, "at_a = 0"),
        _step(3, 11, "(at_b)"),
        "  <<<<<START OF CYCLE>>>>>",
        _step(4, 11, "at_b = 0"),
        _step(5, 12, "(at_c)"),
        _step(6, 12, "at_c = 0"),
        _step(7, 11, "(at_b)"),
    ]
    assert read_trail("\n".join(lines), {10: 0, 11: 1, 12: 2}) == Trail((0,), (1, 2))


def test_a_run_that_is_none_is_not_believed() -> None:
    net = rows(2)
    with pytest.raises(InternalError, match="where it cannot"):
        replay(Encoding(net), [len(net.transitions) - 1] * 2)


# --- running --------------------------------------------------------------------------------------


def test_limits_leave_it_undecided(folders: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert search(rows(8), Limits(memory_mb=6)).stopped is Stopped.MEMORY
    assert search(rows(8), Limits(seconds=0.05)).stopped is Stopped.TIME
    monkeypatch.setattr(queries, "FIRST_DEPTH", 20)
    monkeypatch.setattr(queries, "MOST_DEPTH", 20)
    assert search(rows(3)).stopped is Stopped.DEPTH
    assert not list(folders.iterdir())


def test_more_depth_is_given_where_it_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queries, "FIRST_DEPTH", 20)
    found = search(rows(3))
    assert (found.stopped, found.states) == (None, 4**3 + 3)


def test_storage_changes_no_count_and_a_table_of_bits_proves_nothing() -> None:
    exact, collapse, bitstate = (search(rows(4), storage=each) for each in Storage)
    assert exact.states == collapse.states == bitstate.states == 4**4 + 3
    assert exact.fired == collapse.fired == bitstate.fired
    assert exact.stopped is collapse.stopped is None
    assert bitstate.stopped is Stopped.BITSTATE


def test_a_long_search_is_compiled_again_and_counts_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    commands: list[str] = []
    start = subprocess.Popen

    def noted(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
        commands.append(Path(command[0]).name)
        return start(command, **options)

    monkeypatch.setattr(subprocess, "Popen", noted)
    monkeypatch.setattr(programs, "LONG_SEARCH_S", 0.0)
    tools = Tools.find()
    quick = tools.quick or tools.thorough
    assert quick is not None
    # What compiles better is one that is done before the search is.
    monkeypatch.setattr(Tools, "find", classmethod(lambda _: Tools(tools.spin, quick, quick)))
    found = search(rows(9))
    assert found.states == 4**9 + 3
    began = commands.index("pan")
    assert commands[began : began + 3] == ["pan", Path(quick).name, "pan2"]


def test_a_search_reads_no_trail_of_the_search_before_it(folders: Path) -> None:
    with programs.CheckerFolder() as folder:
        folder.generate("active proctype one() { assert(true) }")
        stale = folder.folder / f"{folder.MODEL}1.trail"
        stale.write_text("0:0:0\n", encoding="utf-8")  # of a checker that was ended too early
        found = folder.search([], [], lambda _printed, _seconds: "")
        assert read(found.text).errors == 0
        assert folder.trail(1) == ""


def test_ctrl_c_ends_the_checker_and_tells_what_was_seen(folders: Path) -> None:
    began = time.monotonic()

    def interrupt(progress: Progress) -> None:
        if progress.seconds > 0.3:
            raise KeyboardInterrupt

    found = search(rows(12), progress=interrupt)
    assert found.stopped is Stopped.INTERRUPTED
    assert found.states > 100
    assert time.monotonic() - began < 60
    assert not list(folders.iterdir())
    assert not [each for each in Path("/proc").glob("[0-9]*/cwd") if _leads_to(each, folders)], (
        "a checker still runs"
    )


def _leads_to(link: Path, folder: Path) -> bool:
    try:
        return str(folder) in str(link.readlink())
    except OSError:
        return False


def test_what_is_missing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SpinMissingError, match=r"Spin is not installed.*apt-get install spin tcc"):
        Tools.find()
    spin = tmp_path / "spin"
    spin.write_text("#!/bin/sh\n")
    spin.chmod(0o755)
    with pytest.raises(SpinMissingError, match=r"C compiler.*apt-get install tcc"):
        Tools.find()
    tcc = tmp_path / "tcc"
    tcc.write_text("#!/bin/sh\n")
    tcc.chmod(0o755)
    assert Tools.find() == Tools(str(spin), str(tcc), None)
