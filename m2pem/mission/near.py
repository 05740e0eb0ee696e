"""Names that a person may have meant."""

from collections.abc import Collection
from difflib import get_close_matches

_MOST_CANDIDATES = 5_000  # difflib compares with each; past this a typo costs seconds


def near(name: str, candidates: Collection[str]) -> str:
    """The candidate most like `name`, or ""."""
    if len(candidates) > _MOST_CANDIDATES or len(name) > 200:
        return ""
    found = get_close_matches(name, candidates, n=1, cutoff=0.75)
    return found[0] if found else ""


def did_you_mean(name: str, candidates: Collection[str], otherwise: str) -> str:
    """A remedy: the near match when there is one, else `otherwise`."""
    match = near(name, candidates)
    return f"did you mean '{match}'?" if match else otherwise
