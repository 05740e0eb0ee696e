"""Every file of others loads and is rehearsed, or is refused with findings that help.

`M2PEM_CORPORA` names a folder of them; without it only the project's own are examined.
"""

import os
from pathlib import Path

import pytest

from tests.each_case import every_file
from tools.corpora.examination import MAX_STEPS, Outcome, examine
from tools.corpora.models import models

ROOT = Path(__file__).parents[2]
OWN = [*models(ROOT / "tests/data"), *models(ROOT / "missions")]
OWN_STEPS = 500
"""What has not ended by then is a loop, which `MAX_STEPS` would go through for seconds."""
FOREIGN = models(Path(os.environ.get("M2PEM_CORPORA") or os.devnull))


@every_file(OWN, FOREIGN)
def test_a_model_loads_or_is_refused_with_findings_that_help(path: Path) -> None:
    found = examine(path, OWN_STEPS if path in OWN else MAX_STEPS)
    assert found.problems == ()
    assert (found.outcome is Outcome.LOADED) != bool(found.rules)


def test_what_is_no_model_is_said_to_be_none(tmp_path: Path) -> None:
    file = tmp_path / "poem.bpmn"
    file.write_text("Roses are red")
    found = examine(file)
    assert found.outcome is Outcome.NO_BPMN
    assert list(found.rules) == ["not-xml"]


def test_an_exception_is_a_problem_and_not_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(path: Path) -> None:
        raise RecursionError(path.name)

    file = tmp_path / "m.bpmn"
    file.write_text("<x/>")
    monkeypatch.setattr("tools.corpora.examination.load_source", broken)
    (problem,) = examine(file).problems
    assert "RecursionError: m.bpmn" in problem
