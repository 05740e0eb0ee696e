"""Whatever is in a file, it is refused with useful findings, or it runs, and replays the same."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from m2pem.bpmn import parse_mission
from tools.corpora.models import models
from tools.fuzzer.fuzz import ROOT, case, seeds, survive

CASES = 250
MANY_CASES = 6_000
CORPORA = os.environ.get("M2PEM_CORPORA", "")


def test_what_is_mutated_is_sound() -> None:
    for path in models(ROOT / "missions"):
        assert parse_mission(path.read_bytes(), path.name).processes, path.name


def test_mutated_files_are_refused_or_run() -> None:
    run_cases(range(CASES), seeds())


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_many_mutated_files_are_refused_or_run() -> None:
    run_cases(range(CASES, MANY_CASES), seeds([Path(CORPORA)] if CORPORA else []))


PROCESS = '<process id="P"><task id="T"/></process>'
ONCE_BROKE = {
    "a cancel event definition beside the processes": f"<cancelEventDefinition/>{PROCESS}",
    "a call of a global choreography task": '<globalChoreographyTask id="G"/>'
    '<process id="P"><callActivity id="C" calledElement="G"/></process>',
    "timers in the far future": PROCESS.replace(
        "<task",
        '<intermediateCatchEvent id="C"><timerEventDefinition><timeDate>9999-12-31T23:59:59Z'
        "</timeDate></timerEventDefinition></intermediateCatchEvent><task",
    ),
}
"""What mutations found, as small as it can be."""


@pytest.mark.parametrize("name", ONCE_BROKE)
def test_what_once_broke_m2pem(name: str) -> None:
    bpmn = "http://www.omg.org/spec/BPMN/20100524/MODEL"
    data = f'<definitions xmlns="{bpmn}" targetNamespace="urn:t">\n{ONCE_BROKE[name]}</definitions>'
    assert survive(data.encode(), 0) in {"refused", "refused with its fleet", "run"}


@given(st.binary(max_size=200))
def test_any_bytes_are_refused_or_run(data: bytes) -> None:
    assert survive(data, 0) == "refused"


def run_cases(numbers: range, sound: list[bytes]) -> None:
    outcomes = set()
    for number in numbers:
        try:
            outcomes.add(survive(case(number, sound), number))
        except Exception as error:
            error.add_note(f"case {number}")
            raise
    assert outcomes >= {"refused", "run"}
