"""Makes docs/extensions.md, and what the web page's editor knows, of m2pem's vocabulary.

`python -m m2pem.bpmn.vocabulary_page page > docs/extensions.md`, and with `json` instead of
`page` `plugins/ocu/web/ui/src/editor/moddle/vocabulary.json`.
"""

import json
import sys
from collections.abc import Iterator

from m2pem.bpmn.names import M2PEM
from m2pem.bpmn.vocabulary import ELEMENTS, EXTENSIONS, Attribute, OwnElement

_HEAD = f"""# m2pem's elements and attributes

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
`python -m m2pem.bpmn.vocabulary_page page`.

## Elements

They are in the `extensionElements` of the BPMN elements that are named, or in each other.
"""
_ATTRIBUTES = """
## Attributes of BPMN's elements

| attribute | of | it is | for |
|---|---|---|---|
"""


def page() -> str:
    """The whole page."""
    elements = "".join(_element(each) for each in ELEMENTS.values())
    return _HEAD + elements + _ATTRIBUTES + "".join(_attributes())


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
    """What a descriptor of bpmn-moddle must have, under the names of m2pem's vocabulary."""
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


def _main(wanted: str) -> str:
    return page() if wanted == "page" else json.dumps(descriptor(), indent=2) + "\n"


if __name__ == "__main__":
    print(_main(sys.argv[1]), end="")
