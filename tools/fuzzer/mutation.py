"""Makes a broken or strange BPMN file out of sound ones, as dice fall."""

import copy
from collections.abc import Callable
from pathlib import Path
from random import Random

from lxml import etree

from m2pem.bpmn.schema import FLOW_ELEMENT_NAMES, ROOT_NAMES, SHAPES
from tools.fuzzer.bytes_mutation import damaged, encoded
from tools.fuzzer.oddities import ATTRIBUTES, TEXTS

_BPMN = "http://www.omg.org/spec/BPMN/20100524/MODEL"
_NAMES = sorted({*FLOW_ELEMENT_NAMES, *ROOT_NAMES, *(tag.rpartition("}")[2] for tag in SHAPES)})
_REFERENCES = frozenset(
    {
        "activityRef",
        "attachedToRef",
        "calledElement",
        "dataObjectRef",
        "dataStoreRef",
        "default",
        "errorRef",
        "escalationRef",
        "messageRef",
        "processRef",
        "signalRef",
        "sourceRef",
        "targetRef",
    }
)
_DIAGRAM = "{http://www.omg.org/spec/BPMN/20100524/DI}BPMNDiagram"
_FRAGMENTS = list(etree.parse(Path(__file__).with_name("fragments.xml")).getroot())
_DEPTHS = (3, 30, 300, 1100, 2300)

Change = Callable[["_Tree"], None]


def mutate(seeds: list[bytes], dice: Random) -> bytes:
    """A file made of one or two of the seeds, which are well-formed."""
    tree = _Tree(dice.choice(seeds), dice.choice(seeds), dice)
    for _ in range(dice.choice((1, 1, 2, 3, 5, 8, 20))):
        dice.choice(_CHANGES)(tree)
    data = etree.tostring(tree.root, pretty_print=dice.random() < 0.3)
    if dice.random() < 0.1:
        data = encoded(data, dice)
    return damaged(data, dice) if dice.random() < 0.1 else data


class _Tree:
    """The document that is changed; `other` is one to take parts from."""

    def __init__(self, data: bytes, other: bytes, dice: Random) -> None:
        self.dice = dice
        self.root = self._parse(data)
        self.other = self._parse(other)

    def _parse(self, data: bytes) -> etree._Element:
        root = etree.fromstring(data, etree.XMLParser(huge_tree=True, recover=True))
        if self.dice.random() < 0.9:  # what is drawn has no effect
            for diagram in root.findall(_DIAGRAM):
                root.remove(diagram)
        return root

    def any(self) -> etree._Element:
        """Some element."""
        return self.dice.choice(list(self.root.iter(etree.Element)))

    def inner(self) -> etree._Element | None:
        """Some element below the root, or None if there is none."""
        below = list(self.root.iter(etree.Element))[1:]
        return self.dice.choice(below) if below else None

    def id(self) -> str:
        """The id of some element, or nonsense."""
        ids = [each.get("id") for each in self.root.iter(etree.Element) if each.get("id")]
        return self.dice.choice([str(each) for each in ids] or ["nothing"])


# --- elements -----------------------------------------------------------------------------------


def _delete(tree: _Tree) -> None:
    element = tree.inner()
    if element is not None:
        _parent(element).remove(element)


def _repeat(tree: _Tree) -> None:
    element = tree.inner()
    if element is not None:
        _parent(element).append(copy.deepcopy(element))


def _move(tree: _Tree) -> None:
    element, target = tree.inner(), tree.any()
    if element is not None and element not in (target, *target.iterancestors()):
        target.insert(tree.dice.randrange(len(target) + 1), element)


def _shuffle(tree: _Tree) -> None:
    element = tree.any()
    children = list(element)
    tree.dice.shuffle(children)
    element[:] = children


def _rename(tree: _Tree) -> None:
    tree.any().tag = f"{{{_BPMN}}}{tree.dice.choice(_NAMES)}"


def _foreign_namespace(tree: _Tree) -> None:
    element = tree.any()
    name = str(element.tag).rpartition("}")[2]
    element.tag = tree.dice.choice((name, f"{{urn:other}}{name}", f"{{{_BPMN}}}{name}"))


def _splice(tree: _Tree) -> None:
    part = copy.deepcopy(tree.dice.choice(list(tree.other.iter(etree.Element))))
    target = tree.any()
    target.insert(tree.dice.randrange(len(target) + 1), part)


def _insert(tree: _Tree) -> None:
    fragment = copy.deepcopy(tree.dice.choice(_FRAGMENTS))
    names = {"id": tree.id(), "new": tree.dice.randrange(10**6)}
    for element in fragment.iter(etree.Element):
        element.text = (element.text or "").format(**names)
        for key, value in element.attrib.items():
            element.set(key, str(value).format(**names))
    target = tree.any()
    target.insert(tree.dice.randrange(len(target) + 1), fragment)


def _nest(tree: _Tree) -> None:
    """Put an element into many others."""
    element = tree.inner()
    if element is None:
        return
    parent = _parent(element)
    name = tree.dice.choice(("subProcess", "subProcess", str(element.tag).rpartition("}")[2]))
    for depth in range(tree.dice.choice(_DEPTHS)):
        outer = etree.SubElement(parent, f"{{{_BPMN}}}{name}")
        if tree.dice.random() < 0.9:
            outer.set("id", f"Nested_{depth}")
        parent = outer
    parent.append(element)


# --- attributes and texts -----------------------------------------------------------------------


def _drop_attribute(tree: _Tree) -> None:
    element = tree.any()
    if element.attrib:
        del element.attrib[tree.dice.choice(sorted(map(str, element.attrib)))]


def _swap_values(tree: _Tree) -> None:
    one, two = tree.any(), tree.any()
    if one.attrib and two.attrib:
        a, b = (tree.dice.choice(sorted(map(str, each.attrib))) for each in (one, two))
        mine, theirs = one.get(a) or "", two.get(b) or ""
        one.set(a, theirs)
        two.set(b, mine)


def _refer_elsewhere(tree: _Tree) -> None:
    """Let a reference name another element."""
    found = [
        (element, key)
        for element in tree.root.iter(etree.Element)
        for key in map(str, element.attrib)
        if key in _REFERENCES
    ]
    if found:
        element, key = tree.dice.choice(found)
        element.set(key, tree.id())


def _set_attribute(tree: _Tree) -> None:
    key, values = tree.dice.choice(ATTRIBUTES)
    tree.any().set(key, tree.dice.choice((*values, tree.id(), tree.dice.choice(TEXTS)[:200])))


def _set_value(tree: _Tree) -> None:
    element = tree.any()
    if element.attrib:
        key = tree.dice.choice(sorted(map(str, element.attrib)))
        element.set(key, tree.dice.choice(TEXTS))


def _set_text(tree: _Tree) -> None:
    """Mostly where there is one."""
    texts = [each for each in tree.root.iter(etree.Element) if (each.text or "").strip()]
    element = tree.dice.choice(texts) if texts and tree.dice.random() < 0.8 else tree.any()
    element.text = tree.dice.choice(TEXTS)


def _edit_text(tree: _Tree) -> None:
    """Cut, repeat or replace a character of a text."""
    texts = [each for each in tree.root.iter(etree.Element) if (each.text or "").strip()]
    if texts:
        element = tree.dice.choice(texts)
        text = element.text or ""
        place = tree.dice.randrange(len(text))
        put = tree.dice.choice(
            ("", text[place] * 2, tree.dice.choice("()[]{}'\"=+-*/.,:;#$\\ \n0Ra"))
        )
        element.text = text[:place] + put + text[place + 1 :]


def _parent(element: etree._Element) -> etree._Element:
    parent = element.getparent()
    assert parent is not None
    return parent


_CHANGES: tuple[Change, ...] = (
    _delete,
    _repeat,
    _move,
    _shuffle,
    _rename,
    _rename,
    _foreign_namespace,
    _splice,
    _splice,
    _insert,
    _insert,
    _insert,
    _nest,
    _drop_attribute,
    _swap_values,
    _refer_elsewhere,
    _refer_elsewhere,
    _set_attribute,
    _set_attribute,
    _set_value,
    _set_text,
    _set_text,
    _edit_text,
    _edit_text,
)
