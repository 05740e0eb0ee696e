"""Suggestions for a name that is not known: what the person may have meant."""

import difflib
from collections.abc import Collection, Iterable

MAX_LISTED = 12

_MOST_CANDIDATES = 5_000  # difflib compares with each; past this a typo costs seconds
_LONGEST_NAME = 200


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return "did you mean 'x' or 'y'?", or "" when no known name is like it."""
    exact = {candidate.lower(): candidate for candidate in known}
    near = difflib.get_close_matches(name.lower(), exact, n=2, cutoff=0.6)
    if not near:
        return ""
    return f"did you mean {' or '.join(repr(exact[match]) for match in near)}?"


def suggest(name: str, known: Iterable[str], what: str) -> str:
    """`did_you_mean`, else a list of the few names that are known; `what` is their plural."""
    names = list(known)
    hint = did_you_mean(name, names)
    if hint:
        return hint
    if not names:
        return f"there are no {what}"
    listed = ", ".join(names[:MAX_LISTED]) + (", ..." if len(names) > MAX_LISTED else "")
    return f"known {what}: {listed}"


def nearest(name: str, candidates: Collection[str], similarity: float = 0.75) -> str:
    """Return the candidate that is spelled most like `name`, or "".

    Much stricter than `did_you_mean`, and quick for names from files of any size. `similarity`:
    the least that counts, from 0 to 1 for equal names.
    """
    if len(candidates) > _MOST_CANDIDATES or len(name) > _LONGEST_NAME:
        return ""
    found = difflib.get_close_matches(name, candidates, n=1, cutoff=similarity)
    return found[0] if found else ""


def suggest_or(name: str, candidates: Collection[str], otherwise: str) -> str:
    """Return "did you mean ...?" for the `nearest` candidate, else `otherwise`."""
    match = nearest(name, candidates)
    return f"did you mean '{match}'?" if match else otherwise
