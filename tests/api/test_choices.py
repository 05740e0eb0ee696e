"""Why resources were chosen, in words."""

from typing import Any

import pytest

from m2pem.api import records as r
from m2pem.api.choices import Candidate, Choice, RoleChoice, choice_of, choice_sentence, why_not

CHOSEN = Candidate("uav2", cost_s=22.0, travel_s=12.0, switching_s=10.0)


def allocated(**roles: Any) -> r.ResourcesAllocated:
    chosen = {name: tuple(each["chosen"]) for name, each in roles.items()}
    considered = {"roles": roles, "together_with": []}
    return r.ResourcesAllocated(1, "P", "Survey", 1, "r1.a1", chosen, considered)


@pytest.mark.parametrize(
    ("other", "why"),
    [
        (
            Candidate("uav1", excluded="requires is false: vehicle.battery = 0.2"),
            "excluded, requires is false: vehicle.battery = 0.2",
        ),
        (Candidate("uav1", held_by="r2.b1", cost_s=1.0, travel_s=1.0), "held by <r2.b1>"),
        (
            Candidate("uav1", cost_s=30.0, travel_s=24.0, battery_s=6.0),
            "costs 8.0 s more (travel +12.0 s, battery +6.0 s, switching -10.0 s)",
        ),
        (
            Candidate("uav1", cost_s=86_400.0),
            "costs 86378.0 s more (its position is not known)",
        ),
        (
            Candidate("uav1", cost_s=20.0, travel_s=20.0),
            "costs 2.0 s less, but another task or role needs it",
        ),
        (
            Candidate("uav1", cost_s=22.0, travel_s=22.0),
            "costs the same, and comes later in the fleet file or is needed by another task",
        ),
        (Candidate("ugv1", cost_s=1.0, travel_s=1.0), "chosen for carrier"),
    ],
)
def test_a_candidate_that_was_not_chosen_has_a_reason(other: Candidate, why: str) -> None:
    roles = {
        "surveyor": RoleChoice(("uav2",), (CHOSEN, other)),
        "carrier": RoleChoice(("ugv1",), ()),
    }
    assert why_not(other, Choice(roles), "surveyor", lambda id_: f"<{id_}>") == why


def test_a_sentence_names_the_first_candidates_and_counts_the_others() -> None:
    candidates: list[dict[str, Any]] = [{"resource": "uav2", "cost_s": 12.0, "travel_s": 12.0}]
    candidates += [
        {"resource": f"ugv{number}", "excluded": 'requires is false: vehicle.domain = "ground"'}
        for number in range(1, 6)
    ]
    record = allocated(
        surveyor={"chosen": ["uav2"], "candidates": candidates, "not_listed": 4},
        relay={"chosen": [], "candidates": [], "not_listed": 0},
    )
    ground = 'vehicle.domain = "ground"'
    assert choice_sentence(record, str) == (
        f"uav2 is chosen for surveyor (12 s away; ugv1: {ground}; ugv2: {ground}; "
        f"ugv3: {ground}; and 6 others); nothing is chosen for relay, which is optional"
    )


def test_a_choice_is_read_as_it_is_journaled() -> None:
    found = {"resource": "uav2", "cost_s": 12.0, "travel_s": None, "battery": 0.5}
    record = allocated(scout={"chosen": ["uav2"], "candidates": [found], "not_listed": 0})
    assert choice_of(record).roles["scout"].candidates == (
        Candidate("uav2", cost_s=12.0, battery=0.5),
    )
