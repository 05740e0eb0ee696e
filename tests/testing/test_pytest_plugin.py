"""The pytest plugin: what it reports, what it lends, and that it is cheap."""

import subprocess
import sys
from pathlib import Path

SUITE = """
import pytest
from m2pem.testing.contracts.contract import Contract, needs

class PumpContract(Contract):
    m2pem_contract = "PumpContract"
    subjects = {"drain": "it can be emptied"}
    def test_fills(self): pass
    @needs("drain")
    def test_drains(self): assert False
    @needs("drain")
    def test_drains_twice(self): assert False

class TestPump(PumpContract):
    unsupported = {"drain": "it has no valve"}
    def test_own(self): pytest.skip("not today")

class TestBroken(PumpContract):
    pass

def test_of_no_contract(): pass
"""


def run_pytest(folder: Path, code: str, *options: str) -> str:
    (folder / "test_it.py").write_text(code)
    without = ("-p", "no:cacheprovider", "-p", "no:schemathesis", "-p", "no:hypothesispytest")
    command = [sys.executable, "-m", "pytest", "-q", *without, *options]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def test_the_report_tells_what_is_kept_and_what_is_not_supported(tmp_path: Path) -> None:
    printed = run_pytest(tmp_path, SUITE)
    report = printed[printed.index("m2pem contracts") :].splitlines()
    assert report[1:4] == [
        "PumpContract of test_it.py::TestBroken: 1 kept, 2 BROKEN",
        "PumpContract of test_it.py::TestPump: 1 kept, 1 skipped, 2 not supported",
        "  not supported: drain: it has no valve (2 tests)",
    ]


def test_the_report_is_the_same_when_other_processes_run_the_tests(tmp_path: Path) -> None:
    printed = run_pytest(tmp_path, SUITE, "-n", "2")
    assert "PumpContract of test_it.py::TestPump: 1 kept, 1 skipped, 2 not supported" in printed


def test_without_contracts_it_reports_nothing(tmp_path: Path) -> None:
    printed = run_pytest(tmp_path, "def test_a(): pass")
    assert "1 passed" in printed
    assert "m2pem contracts" not in printed


def test_a_subject_that_there_is_not_is_refused_with_what_was_meant(tmp_path: Path) -> None:
    code = SUITE.replace('{"drain": "it has no valve"}', '{"drains": "it has no valve"}')
    printed = run_pytest(tmp_path, code)
    assert "TestPump.unsupported: 'drains' cannot be declared unsupported;" in printed
    assert "did you mean 'drain'? PumpContract knows: drain" in printed


def test_a_subject_without_a_reason_is_refused(tmp_path: Path) -> None:
    printed = run_pytest(tmp_path, SUITE.replace("it has no valve", " "))
    assert "TestPump.unsupported['drain'] must say why" in printed


def test_the_assertions_of_contracts_show_what_they_compared(tmp_path: Path) -> None:
    code = """
from m2pem.testing import ServiceContract
def test_it():
    class Odd:
        writes = ("a", "a")
    ServiceContract().test_declares_the_dotted_names_that_it_writes(Odd())
"""
    assert "AssertionError: a name is declared twice\nE       assert 1 == 2" in run_pytest(
        tmp_path, code
    )


def test_a_coroutine_is_run_in_virtual_time(virtual) -> None:
    async def main(clock):
        began_us = clock.now_us()
        await clock.sleep(3600)
        return clock.now_us() - began_us

    assert virtual(main) == 3_600_000_000


def test_an_executive_runs_missions(executive) -> None:
    import asyncio

    from m2pem.testing import scenarios
    from m2pem.testing.harness import run_mission_on

    async def main():
        async with executive(scenarios.fleet("sim", {"ugv1": {}}), speed=10) as control:
            return await run_mission_on(control, scenarios.question(), {"Question": "abort"})

    played = asyncio.run(main())
    assert played.of("PromptAnswered")[0].decision == "abort"


def test_loading_it_loads_nothing_of_m2pem_but_its_package() -> None:
    code = (
        "import sys, pytest; before = set(sys.modules); import m2pem.testing.plugin;"
        "print(sorted(n for n in set(sys.modules) - before if not n.startswith('pluggy')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(
        ["m2pem", "m2pem.hookspecs", "m2pem.lazy_exports", "m2pem.testing", "m2pem.testing.plugin"]
    )
