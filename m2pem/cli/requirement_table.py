"""The table of a run's requirements with their verdicts, and the same for programs."""

from collections.abc import Iterable
from typing import Any

from m2pem.api.requirement_states import RequirementState, worst_first
from m2pem.cli.table import table


def requirement_table(requirements: Iterable[RequirementState]) -> str:
    """Return the table, what is violated first."""
    return table(
        ("REQUIREMENT", "VERDICT", "SINCE", "WHAT", "WHY"),
        [
            (
                each.id,
                each.verdict,
                "" if each.since_s is None else f"{each.since_s:.1f} s",
                each.english.rstrip("."),
                each.reason,
            )
            for each in worst_first(requirements)
        ],
    )


def as_data(requirement: RequirementState) -> dict[str, Any]:
    """Return a requirement with its verdict as JSON values."""
    return {
        "requirement": requirement.id,
        "verdict": requirement.verdict,
        "since": requirement.since_s,
        "because": requirement.reason,
        "english": requirement.english,
        "formula": requirement.formula,
    }
