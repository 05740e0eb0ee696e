"""The example notebook runs in a kernel of Jupyter, and shows what it promises."""

import shutil
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from tests.console import REPOSITORY

FOLDER = REPOSITORY / "examples" / "notebook"
NOTEBOOK = FOLDER / "first_mission.ipynb"


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """The code cells after the notebook was run in a copy of its folder."""
    folder = tmp_path_factory.mktemp("notebook") / "copy"
    shutil.copytree(FOLDER, folder)
    notebook = nbformat.read(folder / NOTEBOOK.name, as_version=4)
    client = NotebookClient(
        notebook,
        timeout=120,
        kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
    )
    client.execute()
    return [each for each in notebook.cells if each.cell_type == "code"]


def shown(cells: list[Any], code: str) -> dict[str, str]:
    """What the cell with that code shows last, by MIME type; its text output as `text/plain`."""
    (cell,) = [each for each in cells if code in each.source]
    output = cell.outputs[-1]
    data: dict[str, str] = dict(output.get("data") or {"text/plain": output["text"]})
    return data


def test_the_notebook_is_kept_without_outputs() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    code = [each for each in notebook.cells if each.cell_type == "code"]
    assert [each.outputs for each in code] == [[]] * len(code)
    assert [each.execution_count for each in code] == [None] * len(code)


@pytest.mark.tried_with(
    "Jupyter",
    "the notebook of the docs is executed",
    kind="Platforms",
    result="missions, findings and runs are shown",
    package="nbclient",
)
def test_missions_are_shown_as_pictures(executed: list[Any]) -> None:
    drawn = shown(executed, "m2pem.draw(mission)")["image/svg+xml"]
    assert 'data-element-id="SurveyField"' in drawn
    failed = shown(executed, "failed.diagram")["image/svg+xml"]
    assert "what is wrong, and where" in failed


def test_findings_and_proofs_are_shown_as_html(executed: list[Any]) -> None:
    assert "nothing found" in shown(executed, "m2pem.check(")["text/html"]
    proof = shown(executed, "m2pem.verify(")["text/html"]
    assert ">holds</strong>: mission.bpmn, process FIRST_MISSION" in proof


def test_a_rehearsal_shows_diagram_and_chart(executed: list[Any]) -> None:
    result = shown(executed, 'answers="answers.yaml"')["text/html"]
    assert result.count("<svg") == 2
    assert ">completed</strong>: mission.bpmn" in result
    bars = shown(executed, "for bar in result.gantt")["text/plain"]
    assert "rover  single_vehicle_routing" in bars
    assert "uav1   area_survey" in bars


def test_rehearsals_are_awaited_together(executed: list[Any]) -> None:
    results = shown(executed, "asyncio.gather")["text/plain"]
    assert "('completed', 'End', " in results
    assert "('completed', 'EndAborted', 0)" in results


def test_an_executive_runs_in_the_background_and_is_steered_from_cell_to_cell(
    executed: list[Any],
) -> None:
    prompt = shown(executed, "m2pem.Executive(")["text/plain"]
    assert prompt == "<Prompt AskOperator: Road and field are free. Begin? [begin, abort]>"
    assert shown(executed, "await run.pause()")["text/plain"] == "paused\n"
    result = shown(executed, "await run.wait()")["text/html"]
    assert ">completed</strong>" in result
    assert result.count("<svg") == 2
