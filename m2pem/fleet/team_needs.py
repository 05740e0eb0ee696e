"""What a member must be able to do alone, so that a team behavior can be made of it.

An arbiter that offers a team behavior itself needs none of this, as long as it has all the members.
"""

from collections.abc import Collection, Mapping

_ROUTE = ("single_vehicle_routing",)

TEAM_NEEDS: Mapping[str, tuple[str, ...]] = {
    "formation": _ROUTE,
    "road_following_formation": _ROUTE,
    "road_sweep": _ROUTE,
    "bridge_crossing": _ROUTE,
    "area_survey": _ROUTE,
    "area_observe": _ROUTE,
    "escort": (*_ROUTE, "follow"),
}
"""By the team behavior's name: the vehicle behaviors that each member must have."""


def lacking(team_behavior: str, offered: Collection[str]) -> tuple[str, ...]:
    """What a vehicle with these behaviors lacks to be a member.

    Nothing for a behavior that cannot be made of others: then there is nothing to be said.
    """
    needs = TEAM_NEEDS.get(team_behavior, ())
    return tuple(name for name in needs if name not in offered)
