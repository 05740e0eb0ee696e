"""Vignettes of the paper with roles by need: they end as those that name their vehicles do."""

from pathlib import Path

import pytest

from m2pem import rehearse, verify
from m2pem.engine.records import BehaviorRequested, TokenEntered
from m2pem.scripting.run_result import RunResult

REPOSITORY = Path(__file__).parents[2]
MISSIONS = REPOSITORY / "missions"
FLEETS = {
    "vignette1": "vignette1.yaml",
    "team_column": "mehds_mixed.yaml",
    **{f"mehds_vignette_{number}": "mehds.yaml" for number in range(1, 5)},
}

ANSWERS = [
    (name, path)
    for name in FLEETS
    for path in sorted((MISSIONS / "answers").glob(f"{name}_*.yaml"))
    if not path.stem.endswith("_live")
]


def fleet(name: str) -> Path:
    return REPOSITORY / "fleet_configs" / FLEETS[name]


def commanded(result: RunResult) -> list[tuple[str, str, tuple[str, ...]]]:
    return sorted(
        (each.element, each.name, tuple(sorted(each.resources)))
        for each in (stamped.record for stamped in result.records)
        if isinstance(each, BehaviorRequested)
    )


def ends(result: RunResult) -> list[str]:
    entered = (each.record for each in result.records)
    return [e.element for e in entered if isinstance(e, TokenEntered) and "End" in e.element]


def test_each_mission_by_need_has_its_fleet() -> None:
    assert {path.stem for path in (MISSIONS / "by_need").glob("*.bpmn")} == FLEETS.keys()


def stories() -> list[object]:
    """The first and the last of each mission, and long ones."""
    ends = {*dict(ANSWERS).items(), *dict(ANSWERS[::-1]).items()}
    return [
        pytest.param(*each, id=each[1].stem, marks=() if each in ends else pytest.mark.long)
        for each in ANSWERS
    ]


@pytest.mark.parametrize(("name", "answers"), stories())
def test_a_vignette_by_need_ends_as_the_one_that_names_its_vehicles(
    name: str, answers: Path
) -> None:
    named, by_need = (
        rehearse(folder / f"{name}.bpmn", fleet(name), answers=answers)
        for folder in (MISSIONS, MISSIONS / "by_need")
    )
    assert by_need.outcome is named.outcome
    if name == "team_column":
        # Another vehicle leads, so that the radar is there later: the camera scans more often.
        assert set(ends(by_need)) == set(ends(named))
        assert set(commanded(by_need)) == set(commanded(named))
    else:
        assert ends(by_need) == ends(named)
        assert commanded(by_need) == commanded(named)


@pytest.mark.parametrize("name", FLEETS)
@pytest.mark.parametrize("engine", ["builtin", pytest.param("spin", marks=pytest.mark.long)])
def test_a_vignette_by_need_holds_over_all_choices(name: str, engine: str) -> None:
    result = verify(MISSIONS / "by_need" / f"{name}.bpmn", fleet(name), engine=engine)
    assert result.holds, str(result)
