"""Link events: pairs of one name on one level (BPMN 2.0.2, 10.5.4 and 10.5.5)."""

from lxml import etree

from m2pem.model.bpmn.names import BPMN
from m2pem.model.bpmn.rules.rule import E, Rule, Topic, W, declared
from m2pem.model.bpmn.rules.tree import Tree, name_of, parent, what

NAME = Rule(
    10541,
    "link-name",
    "10.5.5",
    E,
    "the link has no name",
    "give both of its ends the same name in their linkEventDefinition",
)
NO_TARGET = Rule(
    10542,
    "link-without-target",
    "10.5.4",
    E,
    "the link leads nowhere: no catching link event has its name",
    "add a catching intermediate event with a link of this name to the same process",
)
TARGETS = Rule(
    10543,
    "link-targets",
    "10.5.4",
    E,
    "a link must not have several targets",
    "keep one catching link event of this name",
)
NO_SOURCE = Rule(
    10544,
    "link-without-source",
    "10.5.4",
    W,
    "nothing leads to the link: no throwing link event has its name",
    "add a throwing intermediate event with a link of this name, or delete it",
)
OUTGOING = Rule(
    10545,
    "link-throw-outgoing",
    "10.5.4",
    E,
    "a throwing link event must not have an outgoing flow",
    "delete the flow, or the link",
)
INCOMING = Rule(
    10546,
    "link-catch-incoming",
    "10.5.4",
    E,
    "a catching link event must not have an incoming flow",
    "delete the flow, or the link",
)
BORDER = Rule(
    10547,
    "link-crosses-border",
    "10.5.5",
    E,
    "a link must not leave its process or subprocess",
    "put both of its ends into the same process or subprocess",
)
_Place = tuple[etree._Element, str]


def _links(tree: Tree) -> None:
    throwing: dict[_Place, list[etree._Element]] = {}
    catching: dict[_Place, list[etree._Element]] = {}
    for definition in tree.root.iter(BPMN + "linkEventDefinition"):
        event = parent(definition)
        ends = {"intermediateThrowEvent": throwing, "intermediateCatchEvent": catching}
        found = ends.get(name_of(event))
        if found is None:
            continue  # it must not stand there, which is said elsewhere
        name = definition.get("name", "").strip()
        if name:
            found.setdefault((parent(event), name), []).append(event)
        else:
            tree.say(NAME, definition)
        if found is throwing and tree.out(event):
            tree.say(OUTGOING, event)
        elif found is catching and tree.into(event):
            tree.say(INCOMING, event)
    _pairs(tree, throwing, catching)


def _pairs(
    tree: Tree,
    throwing: dict[_Place, list[etree._Element]],
    catching: dict[_Place, list[etree._Element]],
) -> None:
    elsewhere = {name: events[0] for (_, name), events in catching.items()}
    across: set[str] = set()
    for (outer, name), events in throwing.items():
        if (outer, name) in catching:
            continue
        for event in events:
            if name in elsewhere:
                across.add(name)
                tree.say(BORDER, event, f"{what(elsewhere[name])} has its name elsewhere")
            else:
                tree.say(NO_TARGET, event, f"'{name}'")
    for (outer, name), events in catching.items():
        for event in events[1:]:
            tree.say(TARGETS, event, f"{what(events[0])} is already that of '{name}'")
        if (outer, name) not in throwing and name not in across:
            tree.say(NO_SOURCE, events[0], f"'{name}'")


TOPIC = Topic(declared(globals()), {}, (_links,))
