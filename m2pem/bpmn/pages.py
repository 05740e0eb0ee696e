"""Makes what is generated from the tables of rules and extensions.

| `python -m m2pem.bpmn.pages ...` | writes |
|---|---|
| `rules` | `docs/rules.md` |
| `extensions` | `docs/extensions.md` |
| `editor` | `plugins/ocu/web/ui/src/editor/moddle/vocabulary.json` |
"""

import json
import sys
from collections.abc import Callable, Iterator, Mapping

from m2pem.bpmn.extensions import ELEMENTS, EXTENSIONS, Attribute, OwnElement
from m2pem.bpmn.rules.registry import RULES
from m2pem.bpmn.xml import M2PEM

_RULES_HEAD = """# Rules of mission files

What `m2pem check` holds a mission file to. A finding ends with its rule's name and number:
`[idle-gateway B10601]`. Errors stop a mission from being loaded, warnings do not (unless
`--strict`). Numbers stay; a number that is gone is not used again.

A `B` number is a section of the BPMN 2.0.2 specification (formal/13-12-09) and two digits: `B10601`
is the first rule of section 10.6. What cannot be executed, or means nothing, is an error; what BPMN
forbids but engines and editors live with is a warning.

This page is made from the rules themselves: `python -m m2pem.bpmn.pages rules`.
"""
_RULES_OF_BPMN = """
## BPMN's rules

| number | rule | clause | level | what is wrong | what is right |
|---|---|---|---|---|---|
"""
_RULES_OF_M2PEM = """
## m2pem's own rules

What BPMN leaves open, and what [mission files](missions.md) say to m2pem alone.

| number | rule | level | what is wrong | what is right |
|---|---|---|---|---|
"""


def rules_page() -> str:
    """Return docs/rules.md."""
    return (
        _RULES_HEAD
        + _RULES_OF_BPMN
        + "".join(_rule_rows("B"))
        + _RULES_OF_M2PEM
        + "".join(_rule_rows("M"))
    )


def _rule_rows(letter: str) -> Iterator[str]:
    for rule in RULES:
        if rule.code[0] == letter:
            clause = [rule.clause] if letter == "B" else []
            cells = [rule.code, f"`{rule.slug}`", *clause, rule.severity.value]
            cells += [rule.wrong, rule.right]
            yield f"| {' | '.join(cells)} |\n"


_EXTENSIONS_HEAD = f"""# m2pem's elements and attributes

What m2pem adds to BPMN in a mission file; [mission files](missions.md) shows it in use. The
namespace is `{M2PEM[1:-1]}`:

```xml
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="{M2PEM[1:-1]}">
```

The prefix may be another one, the namespace may not. A prefix or namespace that is only like
m2pem's, and an element of this page without its prefix, are errors (`wrong-namespace`): what they
mark would be lost. So are elements and attributes of m2pem's namespace that are not on this page
(`unknown-extension`); what is on it has no effect anywhere else (`misplaced-extension`).

Extension elements of other programs have no effect on the execution but for those that
[mission files](missions.md#coming-from-another-engine) names. Where m2pem's own would have one,
`m2pem check` says which are ignored, once for each namespace (`foreign-extension`); what editors
keep there for themselves, such as colours, it passes over.

This page is made of the table that the reader checks files by:
`python -m m2pem.bpmn.pages extensions`.

## Elements

They are in the `extensionElements` of the BPMN elements that are named, or in each other.
"""
_EXTENSIONS_ATTRIBUTES = """
## Attributes of BPMN's elements

| attribute | of | it is | for |
|---|---|---|---|
"""


def extensions_page() -> str:
    """Return docs/extensions.md."""
    elements = "".join(_element(each) for each in ELEMENTS.values())
    return _EXTENSIONS_HEAD + elements + _EXTENSIONS_ATTRIBUTES + "".join(_attributes())


def _element(element: OwnElement) -> str:
    text = f"\n### `m2pem:{element.name}`\n\n{element.doc}\n\n"
    if element.places:
        text += f"- In: {_quoted(element.places)}\n"
    inside = [each.name for each in ELEMENTS.values() if element.name in each.children]
    if inside:
        text += f"- Inside: {_quoted(f'm2pem:{name}' for name in inside)}\n"
    if element.text:
        text += f"- Its text: {element.text}\n"
    if element.attributes:
        text += "\n| attribute | it is | for |\n|---|---|---|\n"
        text += "".join(
            f"| `{each.name}` | {each.type} | {each.doc} |\n" for each in element.attributes
        )
    return text


def _quoted(names: Iterator[str] | tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _attributes() -> Iterator[str]:
    for each in EXTENSIONS:
        for attribute in each.attributes:
            cells = [f"`m2pem:{attribute.name}`", _quoted(each.places), attribute.type]
            yield f"| {' | '.join([*cells, attribute.doc])} |\n"


def descriptor() -> dict[str, object]:
    """Return what the editor's descriptor of bpmn-moddle must have, by the names of extensions."""
    return {
        "uri": M2PEM[1:-1],
        "elements": {
            each.name: {
                "attributes": _names(each.attributes),
                "children": sorted(each.children),
                "text": bool(each.text),
            }
            for each in ELEMENTS.values()
        },
        "extensions": {
            each.name: {"places": sorted(each.places), "attributes": _names(each.attributes)}
            for each in EXTENSIONS
        },
    }


def _names(attributes: tuple[Attribute, ...]) -> list[str]:
    return sorted(each.name for each in attributes)


def _editor() -> str:
    return json.dumps(descriptor(), indent=2) + "\n"


_PAGES: Mapping[str, Callable[[], str]] = {
    "rules": rules_page,
    "extensions": extensions_page,
    "editor": _editor,
}

if __name__ == "__main__":
    print(_PAGES[sys.argv[1]](), end="")
