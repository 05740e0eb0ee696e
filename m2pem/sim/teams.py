"""What the members of a team do for a team behavior: one timed motion of them all.

They start together, keep to the speed that the slowest can, and the behavior ends when the last of
them has arrived. They don't watch each other.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence

from m2pem.sim.course import Course, Craft
from m2pem.sim.manoeuvres import (
    Manoeuvre,
    flying_height,
    observe,
    pursue,
    survey,
    survey_tracks,
    under_way,
)
from m2pem.sim.phases import Vector
from m2pem.sim.wishes import Wishes
from m2pem.teams.shapes import SPACING_M, beside, shifted, slot, trimmed


def _formation(default_shape: str) -> Callable[[Sequence[Craft], Wishes], list[Manoeuvre]]:
    def formation(crafts: Sequence[Craft], wishes: Wishes) -> list[Manoeuvre]:
        return [course.plan_manoeuvre() for course in _march(crafts, wishes, default_shape)]

    return formation


@dataclasses.dataclass(frozen=True, slots=True)
class _Leg:
    craft: Craft
    places: list[Vector]
    speed_m_s: float
    wait_s: float = 0.0

    def course(self) -> Course:
        course = under_way(self.craft, self.places[0][2] if self.places else None)
        course.stand(self.wait_s)
        return course.through(self.places, self.speed_m_s)

    def plan_manoeuvre(self) -> Manoeuvre:
        return Manoeuvre(self.course().plan())


def _march(crafts: Sequence[Craft], wishes: Wishes, default_shape: str) -> list[_Leg]:
    shape = wishes.text("shape", default_shape)
    spacing = wishes.number("spacing") or SPACING_M
    speed = min(
        *(min(craft.cruise_m_s, craft.kinematics.max_speed_m_s) for craft in crafts), math.inf
    )
    wished = wishes.number("speed")
    if wished is not None:
        speed = min(wished, *(craft.kinematics.max_speed_m_s for craft in crafts))
    route = wishes.route()
    legs = []
    for index, craft in enumerate(crafts):
        back, left = (part * spacing for part in slot(shape, index))
        up = flying_height(craft, wishes)
        if route is not None:
            places = trimmed(shifted(wishes.places(craft, route, up), left), back)
        elif index:
            places = [_beside(crafts[0], back, left, up)]
        else:
            places = []
        legs.append(_Leg(craft, places, speed))
    return legs


def _beside(lead: Craft, back: float, left: float, up: float) -> Vector:
    stopped = Course(lead)
    east, north, _ = beside(stopped.place[:2], stopped.yaw, back, left)
    return (east, north, up)


def _one_by_one(crafts: Sequence[Craft], wishes: Wishes) -> list[Manoeuvre]:
    manoeuvres = []
    wait_s = 0.0
    for leg in _march(crafts, wishes, "column"):
        course = dataclasses.replace(leg, wait_s=wait_s).course()
        manoeuvres.append(Manoeuvre(course.plan()))
        wait_s = max(wait_s, course.duration_s)
    return manoeuvres


def _escort(crafts: Sequence[Craft], wishes: Wishes) -> list[Manoeuvre]:
    spacing = wishes.number("spacing") or SPACING_M
    vehicle = wishes.target_vehicle()
    return [
        pursue(craft, wishes, vehicle, spacing, math.tau * index / len(crafts))
        for index, craft in enumerate(crafts)
    ]


def _survey(crafts: Sequence[Craft], wishes: Wishes) -> list[Manoeuvre]:
    tracks = survey_tracks(crafts[0], wishes)
    passes = len(tracks) // 2
    bounds = [2 * (passes * index // len(crafts)) for index in range(len(crafts) + 1)]
    return [
        survey(craft, wishes, tracks[bounds[index] : bounds[index + 1]])
        for index, craft in enumerate(crafts)
    ]


def _observe(crafts: Sequence[Craft], wishes: Wishes) -> list[Manoeuvre]:
    return [
        observe(craft, wishes, math.tau * index / len(crafts)) for index, craft in enumerate(crafts)
    ]


TEAM_MANOEUVRES: Mapping[str, Callable[[Sequence[Craft], Wishes], list[Manoeuvre]]] = {
    "formation": _formation("wedge"),
    "road_following_formation": _formation("column"),
    "road_sweep": _formation("line"),
    "bridge_crossing": _one_by_one,
    "escort": _escort,
    "area_survey": _survey,
    "area_observe": _observe,
}
"""By behavior's name, for the members of a team, the lead first."""
