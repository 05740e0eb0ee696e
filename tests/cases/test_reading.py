"""A file of cases that cannot be read says where it is wrong: file, line, case."""

from pathlib import Path

import pytest

from tests.cases import CaseError, read_topic

GOOD = """
- file: a.bpmn
  case: it works
  clause: 10.1
  element: task
  variant: plain
  given: {x: 1}
  steps:
    - start: start a
      at: a
    - message M: nothing
      with: {order: 7}
  then: {ended: completed, data: {x: 1}}
"""


def topic(folder: Path, text: str) -> Path:
    (folder / "a.bpmn").touch()
    path = folder / "topic.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_case_has_its_steps_and_the_line_where_it_stands(tmp_path: Path) -> None:
    [case] = read_topic(topic(tmp_path, GOOD))
    assert (case.line, case.file.name, case.given) == (2, "a.bpmn", {"x": 1})
    assert [step.entered for step in case.steps] == [("start", "a"), ()]
    assert case.steps[0].expected.at == ("a",)
    assert case.steps[1].when.data == {"order": 7}
    assert (case.then.ended, case.then.data) == ("completed", {"x": 1})


@pytest.mark.parametrize(
    ("good", "bad", "said"),
    [
        ("  clause: 10.1\n", "", "topic.yaml:2: it works: `clause:` is missing"),
        ("clause", "claus", "topic.yaml:2: it works: `clause:` is missing"),
        ("  given: {x: 1}", "  givn: {x: 1}", "topic.yaml:7: it works: `givn:` is none of"),
        ("a.bpmn", "b.bpmn", "topic.yaml:2: it works: there is no b.bpmn beside it"),
        ("- start:", "- begin:", "topic.yaml:9: it works: 'begin' begins with none of start"),
        ("- message M:", "- message:", "topic.yaml:11: it works: 'message': message takes 1 to 1"),
        ("completed", "done", "topic.yaml:13: it works: then: `ended:` is one of completed"),
        ("at: a", "on: a", "topic.yaml:9: it works: a step has one input, and this one"),
        ("nothing", "{}", "topic.yaml:11: it works: "),
        ("- file", "- [file", "topic.yaml: "),
    ],
)
def test_what_is_wrong_is_said_with_its_place(
    tmp_path: Path, good: str, bad: str, said: str
) -> None:
    with pytest.raises(CaseError) as caught:
        read_topic(topic(tmp_path, GOOD.replace(good, bad, 1)))
    assert said in str(caught.value)
