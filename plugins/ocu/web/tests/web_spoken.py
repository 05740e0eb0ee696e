"""What a browser hands to screen readers: its tree of roles and names."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from playwright.async_api import Page

WITHIN_S = 30.0
POLL_S = 0.1


@dataclass(frozen=True, slots=True)
class Spoken:
    """One node of the tree, with what is in it."""

    role: str
    name: str
    active: str = ""
    """The name of the node that its keys are for, of one that has the focus for others."""
    inside: list["Spoken"] = field(default_factory=list)

    def all(self) -> list["Spoken"]:
        """It, and all that is in it, in the order of reading."""
        return [self, *(found for each in self.inside for found in each.all())]

    def find(self, role: str, name: str) -> "Spoken":
        """The one of that role and name."""
        found = [each for each in self.all() if (each.role, each.name) == (role, name)]
        assert len(found) == 1, f"{len(found)} of {role} {name}, of {self.names(role)}"
        return found[0]

    def names(self, role: str) -> list[str]:
        """The names of all of a role that are in it."""
        return [each.name for each in self.all() if each.role == role]


async def spoken(page: Page) -> Spoken:
    """The tree of a page, as Chromium computes it now."""
    session = await page.context.new_cdp_session(page)
    try:
        nodes = (await session.send("Accessibility.getFullAXTree"))["nodes"]
    finally:
        await session.detach()
    by_id = {each["nodeId"]: each for each in nodes}
    by_element = {each.get("backendDOMNodeId"): each for each in nodes}

    def name_of(node: dict[str, Any]) -> str:
        return str(node.get("name", {}).get("value", ""))

    def active_of(node: dict[str, Any]) -> str:
        for each in node.get("properties", ()):
            if each["name"] == "activedescendant":
                (related,) = each["value"]["relatedNodes"]
                return name_of(by_element[related["backendDOMNodeId"]])
        return ""

    def made(node: dict[str, Any]) -> list[Spoken]:
        children = [by_id[each] for each in node.get("childIds", ()) if each in by_id]
        inside = [found for each in children for found in made(each)]
        if node.get("ignored"):
            return inside
        return [Spoken(node["role"]["value"], name_of(node), active_of(node), inside)]

    (root,) = made(nodes[0])
    return root


async def until_spoken(page: Page, is_wanted: Callable[[Spoken], bool]) -> Spoken:
    """The tree once it is as wanted; what it was at last is said otherwise."""
    tree = await spoken(page)
    try:
        async with asyncio.timeout(WITHIN_S):
            while not is_wanted(tree):
                await asyncio.sleep(POLL_S)
                tree = await spoken(page)
    except TimeoutError:
        raise AssertionError([(each.role, each.name) for each in tree.all()]) from None
    return tree
