"""Generate pages and the editor's vocabulary from the tables of rules and extensions.

| `python -m m2pem.bpmn.pages ...` | writes |
|---|---|
| `rules` | `docs/rules.md` |
| `extensions` | `docs/extensions.md` |
| `editor` | `plugins/ocu/web/ui/src/editor/moddle/vocabulary.json` |
"""

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping

from m2pem.bpmn.extensions import ELEMENTS, EXTENSIONS, Attribute, OwnElement
from m2pem.bpmn.rules.registry import RULES
from m2pem.bpmn.xml import M2PEM
from m2pem.findings import Severity

_RULES_HEAD = """# Rules of mission files

`m2pem check` applies these rules to a mission file. A finding says where, what is wrong and what
would be right, and ends with its rule's name and number: `[idle-gateway B10601]`. m2pem does not
load a mission with errors, nor, with `--strict`, one with warnings. Numbers never change, and are
never used again.

A `B` number is a section of the BPMN 2.0.2 specification (formal/13-12-09) and two digits: `B10601`
is the first rule of section 10.6. A construct that cannot be executed, or has no meaning, is an
error; one that BPMN forbids but engines and editors accept is a warning.

This page is generated from the rules: `python -m m2pem.bpmn.pages rules`.
"""
_RULES_OF_BPMN = """
## BPMN's rules
"""
_RULES_OF_M2PEM = """
## m2pem's own rules

For questions that BPMN leaves open, and for m2pem's own elements of [mission files](missions.md).
"""
_RULES_TABLE = """
| {level} | what is wrong |
|---|---|
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
    """A table of the errors, and one of the warnings."""
    for severity in Severity:
        yield _RULES_TABLE.format(level=severity.value)
        for rule in RULES:
            if rule.code[0] == letter and rule.severity is severity:
                yield f"| `{rule.slug} {rule.code}` | {rule.wrong} |\n"


_EXTENSIONS_HEAD = f"""# m2pem's elements and attributes

m2pem's additions to BPMN in a mission file; [mission files](missions.md) shows how they are used.
The namespace is `{M2PEM[1:-1]}`:

```xml
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
             xmlns:m2pem="{M2PEM[1:-1]}">
```

The prefix may differ, the namespace may not. Errors are: a prefix or namespace that is only similar
to m2pem's, an element of this page without its prefix (`wrong-namespace`), and an element or
attribute of m2pem's namespace that is not on this page (`unknown-extension`). Elements and
attributes in other places than listed here have no effect (`misplaced-extension`).

Extension elements of other programs have no effect on the execution, except those that
[mission files](missions.md#coming-from-another-engine) names. Where m2pem has an equivalent,
`m2pem check` names those that it ignores, once for each namespace (`foreign-extension`), but not
the settings of editors, such as colours. What changes the execution in Camunda, Zeebe, Flowable,
Activiti or jBPM it names each time (`foreign-effect`).

This page is generated from the table by which m2pem checks files:
`python -m m2pem.bpmn.pages extensions`.

## Elements

"In" names the BPMN elements whose `extensionElements` may have the element, "inside" the m2pem
elements that may contain it. Attributes have the kind of their value in parentheses.
"""
_EXTENSIONS_ATTRIBUTES = """
## Attributes of BPMN's elements

"""


def extensions_page() -> str:
    """Return docs/extensions.md."""
    elements = "".join(_element(each) for each in ELEMENTS.values())
    return _EXTENSIONS_HEAD + elements + _EXTENSIONS_ATTRIBUTES + "".join(_attributes())


def _element(element: OwnElement) -> str:
    where = [f"In {_quoted(element.places)}"] if element.places else []
    inside = tuple(
        f"m2pem:{each.name}" for each in ELEMENTS.values() if element.name in each.children
    )
    if inside:
        where.append(f"{'inside' if where else 'Inside'} {_quoted(inside)}")
    lines = [f"- Its text: {element.text}\n"] if element.text else []
    first = next(each for each in ELEMENTS.values() if each.attributes == element.attributes)
    if element.attributes and first is not element:
        lines.append(f"- Attributes: those of `m2pem:{first.name}`\n")
    else:
        lines += [f"- {_attribute(each.name, each)}\n" for each in element.attributes]
    head = f"\n### `m2pem:{element.name}`\n\n{element.doc} {', '.join(where)}.\n"
    return "".join([head, "\n" if lines else "", *lines])


def _attribute(name: str, attribute: Attribute) -> str:
    return f"`{name}` ({attribute.type}): {attribute.doc}"


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _attributes() -> Iterator[str]:
    for each in EXTENSIONS:
        yield f"- Of {_quoted(each.places)}:\n"
        for attribute in each.attributes:
            yield f"    - {_attribute(f'm2pem:{attribute.name}', attribute)}\n"


def descriptor() -> dict[str, object]:
    """Return the content that the editor's descriptor of bpmn-moddle must have."""
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
