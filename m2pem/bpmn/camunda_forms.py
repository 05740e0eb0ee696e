"""Forms of Camunda 8 on user tasks: m2pem shows none, and says which question would take its place.

A task has `zeebe:formDefinition`. Its form is embedded as JSON in a `zeebe:userTaskForm` of the
process (`formKey="camunda-forms:bpmn:ID"`), or in a file of its own (`formId`).
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape  # xml.sax.saxutils would import urllib.request
from typing import Any

from lxml import etree

from m2pem.bpmn.xml import BPMN, ZEEBE
from m2pem.mission.expression.literals import shorten

DEFINITION = ZEEBE + "formDefinition"
EMBEDDED = ZEEBE + "userTaskForm"

_EMBEDDED_KEY = "camunda-forms:bpmn:"
_CHOICES = ("select", "radio")
_TYPED = ("textfield", "textarea", "number", "datetime", "checklist", "taglist", "filepicker")
_MOST_ANSWERS = 4
_MOST_BYTES = 1_000_000
_MOST_NESTED = 20
EXAMPLE = (
    '<m2pem:prompt>...?</m2pem:prompt><m2pem:decision value="yes" label="Yes"/>'
    '<m2pem:decision value="no" label="No"/>'
)


@dataclass(frozen=True, slots=True)
class _Question:
    """A field that an operator can answer by a decision: value and label of each."""

    key: str
    label: str
    answers: tuple[tuple[str, str], ...]


def form_definition(task: etree._Element) -> etree._Element | None:
    """The `zeebe:formDefinition` of a user task; None if it has none."""
    for outer in task.iterchildren(BPMN + "extensionElements"):
        for each in outer.iterchildren(DEFINITION):
            return each
    return None


def form_name(definition: etree._Element) -> str:
    """The attribute that names the form, as written: `formId="Form_1"`."""
    for key in ("formId", "formKey", "externalReference"):
        if definition.get(key):
            return f'{key}="{shorten(definition.get(key, ""))}"'
    return "without a name"


def form_remedy(definition: etree._Element) -> str:
    """What to write in place of a form: the question that it asks, as far as it can be read."""
    form = _embedded(definition)
    fields = list(_fields(form, 0)) if form is not None else []
    questions = [question for each in fields if (question := _question(each)) is not None]
    typed = [_text(each, "key") for each in fields if each.get("type") in _TYPED]
    said = []
    if questions:
        first, *others = questions
        said.append(f"write {_written(first)}")
        if others:
            names = ", ".join(f"'{shorten(each.key)}'" for each in others)
            said.append(f"ask for {names} in user tasks of their own")
    else:
        texts = [_text(each, "text") for each in fields if each.get("type") == "text"]
        text = shorten(texts[0].strip("# \n")) if texts else ""
        said.append(
            f"write <m2pem:prompt>{escape(text, quote=False)}</m2pem:prompt>"
            if text
            else f"write {EXAMPLE}"
        )
    if typed:
        names = ", ".join(f"'{shorten(each)}'" for each in typed)
        said.append(f"operators type nothing: let a service or --data write {names}")
    return "; ".join(said)


def _embedded(definition: etree._Element) -> dict[str, Any] | None:
    """The form in the file itself; None if it is elsewhere, or is no form."""
    key = definition.get("formKey", "")
    if not key.startswith(_EMBEDDED_KEY):
        return None
    for each in definition.getroottree().getroot().iter(EMBEDDED):
        if each.get("id") == key.removeprefix(_EMBEDDED_KEY):
            text = each.text or ""
            try:
                form = json.loads(text) if len(text) <= _MOST_BYTES else None
            except (ValueError, RecursionError):
                return None
            return form if isinstance(form, dict) else None
    return None


def _fields(holder: dict[str, Any], depth: int) -> Iterator[dict[str, Any]]:
    """The components of a form, with those in groups."""
    components = holder.get("components")
    if not isinstance(components, list) or depth > _MOST_NESTED:
        return
    for each in components:
        if isinstance(each, dict):
            yield each
            yield from _fields(each, depth + 1)


def _question(field: dict[str, Any]) -> _Question | None:
    """The question of a field with a fixed choice."""
    key, label = _text(field, "key"), _text(field, "label")
    if field.get("type") == "checkbox":
        return _Question(key, label, (("true", "Yes"), ("false", "No")))
    values = field.get("values")
    if field.get("type") not in _CHOICES or not isinstance(values, list):
        return None
    answers = tuple(
        (_text(each, "value"), _text(each, "label")) for each in values if isinstance(each, dict)
    )
    return _Question(key, label, answers) if answers else None


def _written(question: _Question) -> str:
    answers = "".join(
        f'<m2pem:decision value="{escape(shorten(value))}" label="{escape(shorten(label))}"/>'
        for value, label in question.answers[:_MOST_ANSWERS]
    )
    more = " ..." if len(question.answers) > _MOST_ANSWERS else ""
    text = escape(shorten(question.label or question.key), quote=False)
    store = escape(shorten(question.key))
    return f'<m2pem:prompt store="{store}">{text}</m2pem:prompt>{answers}{more}'


def _text(field: dict[str, Any], key: str) -> str:
    value = field.get(key, "")
    return value if isinstance(value, str) else json.dumps(value)
