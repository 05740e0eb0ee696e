"""The facts of a candidate for a role, which `requires` and `prefer` read (docs/allocation.md).

Those of the fleet file are known before a mission starts; those of telemetry only while it runs.
"""

from collections.abc import Mapping

FLEET_FACTS: Mapping[str, str] = {
    "vehicle.name": "its name in the fleet file, a text",
    "vehicle.domain": "`'ground'`, `'air'`, `'surface'` or `'subsurface'`",
    "vehicle.arbiter": "the name of its arbiter",
    "vehicle.tags": "the tags of the fleet file, a list of texts",
    "vehicle.behaviors": "the names of the behaviors that it offers, a list of texts",
    "vehicle.payloads": "the names of its payloads, without the vehicle's, a list of texts",
    "vehicle.teams": "the names of the teams that it is a member of, a list of texts",
    "vehicle.cruise_speed": "the speed of the fleet file, m/s; null: not said",
    "payload.name": "of a candidate that is a payload: its name, without the vehicle's",
    "payload.behaviors": "the names of the behaviors that it offers, a list of texts",
    "payload.tags": "the tags of the fleet file, a list of texts",
    "payload.detector": "whether it is a detector",
}
"""Facts that the fleet file says, and what each is. `vehicle.*` of a payload: its vehicle's."""

TELEMETRY_FACTS: Mapping[str, str] = {
    "vehicle.battery": "the charge that is left, from 0 to 1",
    "vehicle.endurance": "how long it can still go, s: `endurance` of the fleet file x battery",
    "vehicle.position": "`[latitude, longitude, altitude]`: degrees, m above mean sea level",
    "vehicle.distance": "the horizontal distance to the place of the task, m",
    "vehicle.travel_time": "the distance at the speed of the task, else the cruise speed, s",
    "vehicle.mode": "the mode that it reports, a text",
    "vehicle.armed": "whether it is armed",
    "vehicle.ready": "whether it says that it is ready to be armed",
}
"""Facts that telemetry says, and what each is; null: not known."""

CANDIDATE_FACTS: Mapping[str, str] = {**FLEET_FACTS, **TELEMETRY_FACTS}
"""All facts of a candidate."""

FACT_TYPES: Mapping[str, type[str] | type[float] | type[bool] | type[list[str]]] = {
    **dict.fromkeys(("vehicle.name", "vehicle.domain", "vehicle.arbiter", "vehicle.mode"), str),
    **dict.fromkeys(("vehicle.battery", "vehicle.endurance", "vehicle.cruise_speed"), float),
    **dict.fromkeys(("vehicle.distance", "vehicle.travel_time"), float),
    **dict.fromkeys(("vehicle.tags", "vehicle.behaviors", "vehicle.payloads"), list),
    **dict.fromkeys(("vehicle.teams", "vehicle.position"), list),
    **dict.fromkeys(("payload.behaviors", "payload.tags"), list),
    **dict.fromkeys(("vehicle.armed", "vehicle.ready", "payload.detector"), bool),
    "payload.name": str,
}
"""The type of each fact, when it is not null."""

PREFIXES = ("vehicle.", "payload.")
"""What begins with one of these in an expression of a role is a fact, not data of the mission."""


def is_fact(name: str) -> bool:
    """Whether a name in an expression of a role is a fact of the candidate."""
    return name.startswith(PREFIXES)
