"""Whatever is in a file, reading it gives a mission, or a MissionError with useful findings."""

import copy
import os
import random
from pathlib import Path

import pytest
from bpmn_text import findings
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from m2pem.errors import MissionError
from m2pem.model.bpmn import parse_mission
from m2pem.model.lint import lint

DATA = Path(__file__).parent.parent / "data" / "model"
SEEDS = [path.read_bytes() for path in sorted(DATA.glob("*.bpmn"))]
SOUND = [path.name for path in sorted(DATA.glob("*.bpmn"))]
CORPORA = os.environ.get("M2PEM_CORPORA", "")


def mutate(data: bytes, random_: random.Random, times: int) -> bytes:
    """Delete, repeat, move and rename elements; scramble attributes and texts."""
    root = etree.fromstring(data)
    for _ in range(times):
        elements = list(root.iter(etree.Element))
        element, other = random_.choice(elements), random_.choice(elements)
        parent = element.getparent()
        match random_.randrange(8):
            case 0 if parent is not None:
                parent.remove(element)
            case 1 if parent is not None:
                parent.append(copy.deepcopy(element))
            case 2 if parent is not None:
                other.append(copy.deepcopy(element))
            case 3:
                element.tag = other.tag
            case 4 if element.attrib:
                del element.attrib[random_.choice(sorted(element.attrib))]
            case 5 if element.attrib and other.attrib:
                key, source = (random_.choice(sorted(each.attrib)) for each in (element, other))
                element.set(key, other.get(source) or "")
            case 6:
                key = random_.choice(
                    ["id", "name", "default", "x", "sourceRef", "class", "timeout"]
                )
                element.set(key, random_.choice(["", "${", "x:y", "Sub", "=", "a b", "${a}"]))
            case _:
                element.text = random_.choice(["", "${", "<behavior", "a = ", "PT", None, "x"])
    return etree.tostring(root)


def survives(data: bytes) -> None:
    try:
        mission = parse_mission(data, "fuzz.bpmn")
    except MissionError as error:
        assert error.findings
        for finding in error.findings:
            assert finding.line > 0
            assert finding.message
            assert finding.remedy
    else:
        lint(mission)
        for node in mission.nodes:
            assert node in node.container.nodes


def fuzz(seed: int, times: int, seeds: list[bytes]) -> None:
    random_ = random.Random(seed)
    survives(mutate(random_.choice(seeds), random_, times))


@pytest.mark.parametrize("name", SOUND)
def test_what_is_mutated_is_sound(name: str) -> None:
    assert parse_mission((DATA / name).read_bytes(), name).warnings == ()


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32), times=st.integers(1, 12))
def test_mutated_files_never_break_the_reader(seed: int, times: int) -> None:
    fuzz(seed, times, SEEDS)


@pytest.mark.long
@settings(max_examples=10_000, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32), times=st.integers(1, 30))
def test_many_mutated_files_never_break_the_reader(seed: int, times: int) -> None:
    foreign = [path.read_bytes() for path in corpus() if path.stat().st_size < 50_000]
    fuzz(seed, times, SEEDS + foreign)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_damaged_bytes_never_break_the_reader(data: st.DataObject) -> None:
    seed = bytearray(data.draw(st.sampled_from(SEEDS)))
    for _ in range(data.draw(st.integers(1, 5))):
        seed[data.draw(st.integers(0, len(seed) - 1))] = data.draw(st.integers(0, 255))
    survives(
        bytes(seed[: data.draw(st.integers(0, len(seed)))] if data.draw(st.booleans()) else seed)
    )


@given(st.binary(max_size=200))
def test_any_bytes(data: bytes) -> None:
    survives(data)


def corpus() -> list[Path]:
    """The foreign files, of the folder that M2PEM_CORPORA names."""
    return sorted(Path(CORPORA).rglob("*.bpmn")) if CORPORA else []


@pytest.mark.long
@pytest.mark.skipif(not CORPORA, reason="M2PEM_CORPORA names no folder of foreign BPMN files")
def test_foreign_files_load_or_are_refused_with_useful_findings() -> None:
    files = corpus()
    assert files, f"no .bpmn file in {CORPORA}"
    for path in files:
        for finding in findings(path.read_bytes()):
            assert finding.line > 0, (path, finding)
            assert finding.message, path
            assert finding.remedy, (path, finding)
