"""Suggestions for a name that is not known: what the person may have meant."""

import difflib
from collections.abc import Iterable

MAX_LISTED = 12


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """ "did you mean 'x' or 'y'?", or "" when nothing known is near."""
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
