"""Holds docs/allocation.md to the facts of candidates and the findings about roles by need."""

import re
from pathlib import Path

from m2pem.fleet import need_check, same_vehicle
from m2pem.fleet.shortage import RULE
from m2pem.mission.candidate_facts import CANDIDATE_FACTS, FLEET_FACTS, is_fact

PAGE = (Path(__file__).parents[2] / "docs" / "allocation.md").read_text(encoding="utf-8")


def test_the_page_has_the_table_of_facts() -> None:
    table = PAGE.partition("<!-- begin: facts -->")[2].partition("<!-- end: facts -->")[0]
    rows = [line.strip("| ").split(" | ") for line in table.strip().splitlines()[2:]]
    assert rows == [
        [f"`{name}`", "fleet file" if name in FLEET_FACTS else "telemetry", meaning]
        for name, meaning in CANDIDATE_FACTS.items()
    ]


def test_every_fact_is_known_by_its_prefix() -> None:
    assert all(map(is_fact, CANDIDATE_FACTS))


def test_the_page_has_every_finding_about_roles_by_need() -> None:
    code = Path(need_check.__file__).read_text(encoding="utf-8")
    findings = set(re.findall(r'findings\.add\(\s*"([\w-]+)"', code))
    findings |= {RULE, same_vehicle.RULE}
    table = PAGE.partition("| finding |")[2].partition("\n\n")[0]
    assert set(re.findall(r"^\| `([\w-]+)` \|", table, re.M)) == findings
