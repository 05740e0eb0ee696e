"""The catalogue of patterns, by name."""

from collections.abc import Mapping

from m2pem.verify.requirements.patterns.occurrence import OCCURRENCE
from m2pem.verify.requirements.patterns.pattern import Argument, Kind, Pattern
from m2pem.verify.requirements.patterns.robotic import AVOIDANCE, REACTIONS, VISITS
from m2pem.verify.requirements.patterns.teams import TEAMS

GROUPS: Mapping[str, tuple[Pattern, ...]] = {
    "Visits": VISITS,
    "Avoidance": AVOIDANCE,
    "Reactions": REACTIONS,
    "Occurrence": OCCURRENCE,
    "Teams": TEAMS,
}
"""Patterns by the heading that they have in docs/requirements.md."""

PATTERNS: Mapping[str, Pattern] = {
    pattern.name: pattern for group in GROUPS.values() for pattern in group
}

__all__ = ["Argument", "GROUPS", "Kind", "PATTERNS", "Pattern"]
