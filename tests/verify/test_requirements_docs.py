"""The page on requirements shows every pattern, and the English that it shows is m2pem's."""

import re
from pathlib import Path

import pytest

from m2pem import load_mission
from m2pem.fleet.default_fleet import fleet_for
from m2pem.verify.requirements import Names, Requirement, parse_spec
from m2pem.verify.requirements.patterns import PATTERNS
from tests.verify.answers import check_mission

REPOSITORY = Path(__file__).parents[2]
PAGE = (REPOSITORY / "docs" / "requirements.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```yaml\n(.*?)```\n(.*?)(?=\n#|\n```|\Z)", PAGE, re.S)
SECTIONS = dict(re.findall(r"^#### (\w+)\n\n(.*?)(?=^#|\Z)", PAGE, re.S | re.M))
MISSION = load_mission(REPOSITORY / "missions" / "survey_pair.bpmn")
NAMES = Names(MISSION, fleet_for(MISSION))


def read(example: str) -> list[Requirement]:
    text = f"requirements:\n{example}" if example.startswith("- ") else example
    return parse_spec(text.encode(), "docs/requirements.md", NAMES)


@pytest.mark.parametrize(("example", "after"), EXAMPLES, ids=lambda text: text.strip()[:40])
def test_examples_mean_what_the_page_says(example: str, after: str) -> None:
    said = [line[2:].strip() for line in after.splitlines() if line.startswith("> ")]
    english = [each.english for each in read(example)]
    assert english and said in ([], english)


def test_the_page_shows_what_m2pem_says() -> None:
    assert sum(line.startswith("> ") for line in PAGE.splitlines()) > 3


def test_every_pattern_has_a_section_that_shows_it() -> None:
    assert set(SECTIONS) == set(PATTERNS)
    for name, pattern in PATTERNS.items():
        section = " ".join(SECTIONS[name].split())
        assert section.lower().startswith(pattern.meaning.lower())
        assert f"pattern: {name}" in section
        assert all(f"`{each.name}`" in section for each in pattern.arguments)


def test_what_the_page_says_of_the_other_mission_is_said() -> None:
    mission = load_mission(REPOSITORY / "missions" / "vignette1.bpmn")
    section = " ".join(SECTIONS["operator_in_the_loop"].split())
    entry, said = re.search(r'`({.*})` .*: "(.*)"', section).groups()  # type: ignore[union-attr]
    names = Names(mission, fleet_for(mission))
    (found,) = parse_spec(f"requirements: [{entry}]".encode(), "docs", names)
    assert found.english == said


def test_every_example_can_be_checked() -> None:
    requirements = [each for example, _ in EXAMPLES for each in read(example)]
    answers = check_mission(MISSION, fleet_for(MISSION), requirements)
    assert not [each.why for each in answers if each.why]
