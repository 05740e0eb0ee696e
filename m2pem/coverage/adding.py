"""Adds what was suggested to a file of scenarios, as scenarios that pass."""

import os
from collections.abc import Iterable
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from m2pem.coverage.items import Kind
from m2pem.coverage.scripting import Content
from m2pem.coverage.suggesting import Suggestion


def add_scenarios(path: Path, fleet: str, suggestions: Iterable[Suggestion]) -> int:
    """Add scenarios to a file, which is made if it is not there; return how many.

    Comments and the order of the file are kept. `fleet`: of a new file, from here.

    Raises:
        OSError: it cannot be written.
    """
    yaml = _yaml()
    content = yaml.load(path.read_text(encoding="utf-8")) if path.exists() else None
    if content is None:
        located = fleet if fleet == "sim" else os.path.relpath(fleet, path.parent)
        content = CommentedMap(fleet=located)
    known = content.get("scenarios") or []
    titles = {each["scenario"] for each in known}
    added = [_scenario(each, titles) for each in suggestions]
    content["scenarios"] = known
    known.extend(added)
    out = StringIO()
    yaml.dump(content, out)
    new = path.with_name(f".{path.name}.new")
    new.write_text(out.getvalue(), encoding="utf-8")
    new.replace(path)
    return len(added)


def _scenario(suggestion: Suggestion, titles: set[str]) -> CommentedMap:
    what = suggestion.reaches[0].label
    title, number = f"reaches {what}", 2
    while title in titles:  # it does so no more, and the scenario has failed
        title, number = f"reaches {what}, {number}", number + 1
    titles.add(title)
    scenario = CommentedMap(scenario=title)
    if suggestion.answers:
        scenario["when"] = _sections(suggestion.answers)
    scenario["then"] = _expected(suggestion)
    return scenario


def _expected(suggestion: Suggestion) -> CommentedMap:
    """How it ended, and that it reaches the elements for which it was suggested."""
    expected = CommentedMap(ended=suggestion.ended)
    if suggestion.entered:
        expected["entered"] = " ".join(suggestion.entered)
    errors = [f"error {item.id}" for item in suggestion.reaches if item.kind is Kind.ERROR]
    if errors:
        expected["throws"] = _in_one_line(errors)
    return expected


def _sections(answers: Content) -> CommentedMap:
    """Answers, each visit list in one line."""
    found = CommentedMap()
    for section, entries in answers.items():
        if isinstance(entries, dict):
            found[section] = CommentedMap(
                {key: _in_one_line(each) for key, each in entries.items()}
            )
        else:
            found[section] = _in_one_line(entries)
    return found


def _in_one_line(value: Any) -> Any:
    if isinstance(value, dict):
        made: Any = CommentedMap({key: _in_one_line(each) for key, each in value.items()})
    elif isinstance(value, list | tuple):
        made = CommentedSeq([_in_one_line(each) for each in value])
    else:
        return value
    made.fa.set_flow_style()
    return made


def yaml_of(answers: Content) -> str:
    """Return the text of an answers file."""
    out = StringIO()
    _yaml().dump(_sections(answers), out)
    return out.getvalue()


def _yaml() -> YAML:
    yaml = YAML()
    yaml.width = 4096  # lines of others are not broken
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.brace_single_entry_mapping_in_flow_sequence = True
    return yaml
