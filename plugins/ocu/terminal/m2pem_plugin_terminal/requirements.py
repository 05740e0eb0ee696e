"""The requirements that a run is monitored for, in a dialog: what is violated first."""

from collections.abc import Collection

from rich.text import Text

from m2pem.api import RequirementState, worst_first

TITLE = "Requirements"
STYLES = {"violated": "bold #e07a6a", "open": "#e8c468", "satisfied": "#7fc8a9"}


def requirements_text(run: str, requirements: Collection[RequirementState]) -> Text:
    """Return each requirement with its verdict, since when, and what made it certain."""
    if not requirements:
        return Text(f"{run} is monitored for no requirement.")
    text = Text()
    for each in worst_first(requirements):
        since = "" if each.since_s is None else f" since {each.since_s:.1f} s"
        text.append(f"{each.verdict}{since}", STYLES[each.verdict])
        text.append(f"  {each.id}\n", "bold #e3e8ee")
        text.append(f"  {each.english}\n", "#c8d0d9")
        if each.reason:
            text.append(f"  {each.reason}\n", "#9aa4af")
    text.rstrip()
    return text
