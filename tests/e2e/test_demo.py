"""`m2pem demo`: as a user runs it, in a folder of their own."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from m2pem.demo.programs import Programs, m2pem
from m2pem.demo.shipped_files import examples
from m2pem.errors import OperatorError
from tests.command_line import REPOSITORY
from tests.terminal import CTRL_C, Terminal

CTRL_X = b"\x18"


def test_the_paper_mission_runs_in_two_ways_outside_of_the_repository(tmp_path: Path) -> None:
    done = subprocess.run(
        m2pem("demo"),
        check=False,
        cwd=tmp_path,
        env={**os.environ, "HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "`m2pem runs --journal .demo/journal.db`" in done.stdout
    assert [each.name for each in tmp_path.iterdir()] == [".demo"], "the user's own journal"
    assert "r1 terminated: terminated by mission ended" in done.stdout
    assert "r2 terminated: terminated by mission ended" in done.stdout
    first, second = done.stdout.split("The second way")
    assert "hazard" in first
    assert "DRIVE ROUTE: evsg1 ends single_vehicle_routing: succeeded" in second


def test_on_a_terminal_a_person_reads_what_to_do_before_the_screen_covers_it(
    tmp_path: Path,
) -> None:
    with Terminal(tmp_path, "demo", M2PEM_OPERATOR="anna@here") as terminal:
        terminal.until(r"and 2 \(Abort\) when you are asked again")
        terminal.until("Press Enter to begin")
        terminal.press(b"\r")
        terminal.until("Send the route")
        terminal.press(CTRL_X)
        terminal.until("STOP r1")
        terminal.press(CTRL_X)
        assert terminal.rest() == 130


def test_a_demonstration_that_was_not_begun_has_no_run(tmp_path: Path) -> None:
    with Terminal(tmp_path, "demo") as terminal:
        terminal.until("Press Enter to begin")
        terminal.press(CTRL_C)
        assert terminal.rest() == 130
    assert list((tmp_path / ".demo").iterdir()) == []


def test_a_folder_in_which_no_journal_can_be_is_reported(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from m2pem.demo import demos

    monkeypatch.chdir(tmp_path)
    (tmp_path / ".demo").write_text("a file", encoding="utf-8")
    with pytest.raises(OperatorError, match="in a folder of yours"):
        demos.vignette()


def test_a_demonstration_without_its_plugin_names_the_plugin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from m2pem.demo import demos

    monkeypatch.setattr(demos, "find_spec", lambda _: None)
    with pytest.raises(OperatorError, match="pip install 'm2pem-plugin-mavlink'"):
        demos.air()


def test_the_missions_of_an_installed_package_are_found_inside_of_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from m2pem.demo import shipped_files

    package = tmp_path / "site" / "m2pem"
    monkeypatch.setattr(shipped_files, "__file__", str(package / "demo" / "shipped_files.py"))
    with pytest.raises(OperatorError, match="install m2pem again"):
        examples()
    for name in ("missions", "fleet_configs"):
        shutil.copytree(REPOSITORY / name, package / "examples" / name)
    assert examples() == package / "examples"


def test_programs_end_the_last_one_first_also_when_the_demonstration_is_interrupted(
    tmp_path: Path,
) -> None:
    log = tmp_path / "log"
    code = (
        "import signal, sys, time\n"
        "def end(*_):\n"
        "    with open(sys.argv[1], 'a') as log: log.write(sys.argv[2])\n"
        "    sys.exit()\n"
        "signal.signal(signal.SIGTERM, end)\n"
        "print('ready', flush=True)\n"
        "while True: time.sleep(60)\n"
    )
    before = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(KeyboardInterrupt), Programs() as programs:
            for name in ("vehicles ", "executive "):
                programs.start([sys.executable, "-c", code, log, name], ready="ready")
            raise KeyboardInterrupt
    finally:
        signal.signal(signal.SIGTERM, before)
    assert log.read_text(encoding="utf-8") == "executive vehicles "


def test_a_program_that_ends_before_it_is_ready_is_reported() -> None:
    before = signal.getsignal(signal.SIGTERM)
    try:
        with Programs() as programs, pytest.raises(OperatorError, match="status 3 before it was"):
            programs.start([sys.executable, "-c", "raise SystemExit(3)"], ready="ready")
    finally:
        signal.signal(signal.SIGTERM, before)
