"""What remains of a plan, at another speed: the same way, from where and as fast as it is now."""

import math
from collections.abc import Sequence

import msgspec

from m2pem.simulation.domains import Kinematics
from m2pem.simulation.phases import Curve, Pivot, Pose, Stand, Travel, along
from m2pem.simulation.speed import Profile, chain
from m2pem.simulation.track import Phase, Plan

_NOTHING = 1e-9


def retimed(
    plan: Plan[Pose], tau: float, speed_m_s: float, limit_m_s: float, kinematics: Kinematics
) -> Plan[Pose] | None:
    """A plan that goes on from plan time `tau`, at which the vehicle goes `speed_m_s`.

    `limit_m_s`: how fast it may go from now on; it brakes if it is faster. None: it has arrived, or
    its plan repeats without a stop.
    """
    limit = min(limit_m_s, kinematics.max_speed_m_s)
    index, inside = plan.place(tau)
    first = plan.cycle_from
    lap = () if first is None else plan.phases[first:]
    if tau >= plan.duration_s or (lap and _moves_at_first(lap[0])):
        return None
    rest = [_remaining(plan.phases[index], inside), *plan.phases[index + 1 :]]
    if first is not None and index < first:
        rest = rest[: first - index]
    timed = _timed(rest, speed_m_s, limit, kinematics)
    if not lap:
        return Plan(timed) if timed else None
    return Plan([*timed, *_timed(lap, 0.0, limit, kinematics)], cycle_from=len(timed))


def _moves_at_first(phase: Phase[Pose]) -> bool:
    return isinstance(phase, Travel | Curve) and phase.profile.v_in > _NOTHING


def _remaining(phase: Phase[Pose], inside_s: float) -> Phase[Pose]:
    match phase:
        case Travel() | Curve():
            gone = phase.profile.at(inside_s)[0]
            return _part(phase, gone, phase.profile.length, phase.profile)
        case Pivot():
            left_s = phase.duration_s - inside_s
            share = left_s / phase.duration_s if phase.duration_s > 0 else 0.0
            return Pivot(phase.place, phase.at(inside_s).yaw, phase.sweep * share, left_s)
        case Stand():
            return msgspec.structs.replace(phase, duration_s=phase.duration_s - inside_s)
        case _:
            return phase


def _part(phase: Travel | Curve, from_m: float, to_m: float, profile: Profile) -> Travel | Curve:
    """A piece of a way; the profile gets its length."""
    length = to_m - from_m
    profile = msgspec.structs.replace(profile, length=length)
    if isinstance(phase, Travel):
        return Travel(
            along(phase.start, phase.direction, from_m), phase.direction, phase.yaw, profile
        )
    whole = phase.profile.length
    return Curve(
        phase.centre,
        phase.radius,
        phase.angle + phase.sweep * from_m / whole,
        phase.sweep * length / whole,
        phase.up + phase.climb * from_m / whole,
        phase.climb * length / whole,
        profile,
    )


def _timed(
    phases: Sequence[Phase[Pose]], speed: float, limit: float, kinematics: Kinematics
) -> list[Phase[Pose]]:
    """Stretches between two stops, each timed anew; `speed`: at the beginning of the first."""
    found: list[Phase[Pose]] = []
    run: list[Travel | Curve] = []
    for phase in phases:
        if isinstance(phase, Travel | Curve):
            run.append(phase)
            if phase.profile.v_out > _NOTHING:
                continue
        found += _stretch(run, speed, limit, kinematics)
        run = []
        speed = 0.0
        if not isinstance(phase, Travel | Curve):
            found.append(phase)
    return found


def _stretch(
    run: Sequence[Travel | Curve], speed: float, limit: float, kinematics: Kinematics
) -> list[Phase[Pose]]:
    """One stretch, to its stop. First of all it brakes, if it is too fast."""
    accel, decel = kinematics.acceleration_m_s2, kinematics.deceleration_m_s2
    found: list[Phase[Pose]] = []
    left: list[Travel | Curve] = []
    for phase in run:
        length = phase.profile.length
        if length <= _NOTHING:
            continue
        brakes_m = max(0.0, speed**2 - limit**2) / (2 * decel) if not left else 0.0
        braked_m = min(length, brakes_m)
        if braked_m > _NOTHING:
            slower = math.sqrt(max(0.0, speed**2 - 2 * decel * braked_m))
            found.append(
                _part(phase, 0.0, braked_m, Profile(braked_m, speed, speed, slower, accel, decel))
            )
            speed = slower
        if length - braked_m > _NOTHING:
            left.append(_part(phase, braked_m, length, phase.profile))
    pieces = [(phase.profile.length, _bound(phase, limit, kinematics)) for phase in left]
    profiles = chain(pieces, accel, decel, v_in=speed)
    return [
        *found,
        *(
            _part(phase, 0.0, phase.profile.length, profile)
            for phase, profile in zip(left, profiles, strict=True)
        ),
    ]


def _bound(phase: Travel | Curve, limit: float, kinematics: Kinematics) -> float:
    """How fast its shape lets it be."""
    length = phase.profile.length
    if isinstance(phase, Curve):
        climb_m = abs(phase.climb)
        limit = min(limit, phase.radius * kinematics.turn_rate_rad_s)
    else:
        climb_m = abs(phase.direction[2]) * length
    if climb_m > _NOTHING and kinematics.climb_rate_m_s:
        limit = min(limit, kinematics.climb_rate_m_s * length / climb_m)
    return limit
