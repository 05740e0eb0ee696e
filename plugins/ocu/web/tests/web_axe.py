"""What axe-core, which checks pages against WCAG, says of a page."""

from dataclasses import dataclass, field

from axe_playwright_python.async_playwright import Axe
from playwright.async_api import Page

# Rules of WCAG 2.2 A and AA, and what axe's makers advise besides.
TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
OPTIONS = {"runOnly": TAGS, "resultTypes": ["violations"]}
SHOWN = 3
AXE = Axe()


@dataclass(slots=True)
class Accessibility:
    """Looks at one page after another, and keeps what was wrong with each."""

    page: Page
    wrong: list[str] = field(default_factory=list)
    looked: list[str] = field(default_factory=list)

    async def look(self, what: str, part: str = "") -> None:
        """At all that is on the page now, once nothing moves any more.

        `part`: a selector of what alone has changed, where the rest was looked at before.
        """
        await self.page.evaluate(STILL)
        if await self.page.evaluate("typeof axe === 'undefined'"):
            await self.page.evaluate(AXE.axe_script)
        violations = await self.page.evaluate(
            "([part, options]) => axe.run(part || document, options).then((it) => it.violations)",
            [part, OPTIONS],
        )
        self.looked.append(what)
        if repeated := await self.page.evaluate(REPEATED_IDS):
            self.wrong.append(f"{what}: ids are there twice: {', '.join(repeated)}")
        for violation in violations:
            nodes = violation["nodes"]
            self.wrong.append(f"{what}: {violation['id']} ({len(nodes)}): {violation['help']}")
            for node in nodes[:SHOWN]:
                self.wrong.append(f"    {node['html'][:160]}\n      {why(node)}")

    def assert_well(self) -> None:
        assert not self.wrong, "\n".join(self.wrong)


def why(node: dict[str, list[dict[str, str]]]) -> str:
    checks = [*node["any"], *node["all"], *node["none"]]
    return "; ".join(check["message"] for check in checks)[:240]


# Labels refer to elements by their ids; axe sees only those of the part.
REPEATED_IDS = """() => {
  const ids = [...document.querySelectorAll("[id]")].map((each) => each.id);
  return ids.filter((id, place) => ids.indexOf(id) < place);
}"""

# Colours in the middle of a transition are no colours of the page.
STILL = """() => Promise.all(
  document.getAnimations()
    .filter((each) => each.effect?.getComputedTiming().endTime !== Infinity)
    .map((each) => each.finished.catch(() => undefined)),
)"""
