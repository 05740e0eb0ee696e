"""Makes docs/rules.md: `python -m m2pem.bpmn.rules.page > docs/rules.md`."""

from collections.abc import Iterator

from m2pem.bpmn.rules.registry import RULES

_HEAD = """# Rules of mission files

What `m2pem check` holds a mission file to. A finding ends with its rule's name and number:
`[idle-gateway B10601]`. Errors stop a mission from being loaded, warnings do not (unless
`--strict`). Numbers stay; a number that is gone is not used again.

A `B` number is a section of the BPMN 2.0.2 specification (formal/13-12-09) and two digits: `B10601`
is the first rule of section 10.6. What cannot be executed, or means nothing, is an error; what BPMN
forbids but engines and editors live with is a warning.

This page is made from the rules themselves: `python -m m2pem.bpmn.rules.page`.
"""
_BPMN = """
## BPMN's rules

| number | rule | clause | level | what is wrong | what is right |
|---|---|---|---|---|---|
"""
_OWN = """
## m2pem's own rules

What BPMN leaves open, and what [mission files](missions.md) say to m2pem alone.

| number | rule | level | what is wrong | what is right |
|---|---|---|---|---|
"""


def page() -> str:
    """The whole page."""
    return _HEAD + _BPMN + "".join(_rows("B")) + _OWN + "".join(_rows("M"))


def _rows(letter: str) -> Iterator[str]:
    for rule in RULES:
        if rule.code[0] == letter:
            clause = [rule.clause] if letter == "B" else []
            cells = [rule.code, f"`{rule.slug}`", *clause, rule.severity.value]
            cells += [rule.wrong, rule.right]
            yield f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    print(page(), end="")
