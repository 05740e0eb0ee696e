"""How long a vehicle's battery lasts, and whether it is enough for what is left of a behavior."""

from dataclasses import dataclass

RESERVE = 0.2
"""Fraction of a full battery that plans leave unused."""

MEASURED_S = 60.0
"""The use of a battery is taken from its telemetry after that time; before, from `endurance`."""

TURN_BACK_S = 10.0
"""How long before a vehicle must turn back it is said that its battery is too low for the rest."""


def lasts_s(endurance_s: float, charge: float | None) -> float:
    """Return how long a vehicle can move until its battery is at `RESERVE`; `charge` None: it is
    not known, and taken for full."""
    return endurance_s * max(0.0, (1.0 if charge is None else charge) - RESERVE)


@dataclass(frozen=True, slots=True)
class BatteryReading:
    """The charge of a battery, from 0 to 1, at a time in seconds."""

    at_s: float
    charge: float


def use_per_s(endurance_s: float, begin: BatteryReading, now: BatteryReading) -> float:
    """Return which part of a full battery a vehicle uses in a second.

    `begin`: as its behavior began. The greater of what `endurance` says and what was used since
    counts, once that was measured for `MEASURED_S`.
    """
    took_s = now.at_s - begin.at_s
    stated = 1.0 / endurance_s
    if took_s < MEASURED_S:
        return stated
    return max(stated, (begin.charge - now.charge) / took_s)


def too_low_for_rest(
    charge: float, use: float, rest_s: float, home_after_s: float, home_now_s: float
) -> bool:
    """Whether a vehicle cannot do the rest, and has to turn back now.

    `use`: the part of a full battery that it uses in a second. `rest_s`: how long the rest takes;
    infinite if it has no end. `home_after_s`, `home_now_s`: how long the way home takes from the
    end of the rest, and from where it is. `RESERVE` is left at home. So a vehicle that cannot do
    all of the rest does as much of it as it can.
    """
    left_s = (charge - RESERVE) / use
    return left_s < rest_s + home_after_s and left_s <= home_now_s + TURN_BACK_S
