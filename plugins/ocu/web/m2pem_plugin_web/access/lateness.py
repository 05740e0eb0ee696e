"""How old a command is when it arrives: a network that stalls may deliver it much later.

Every snapshot and frame has the executive's clock (`now`: monotonic, seconds). A page sends with
a command when it was given, on that clock, so that neither clock needs to be set.
"""

import math
import time

from starlette.requests import HTTPConnection

from m2pem_plugin_web.problems import ProblemError

GIVEN = "M2pem-Given"
"""The header: seconds of the executive's clock."""

LONGEST_S = 5.0
"""Age beyond which a command is refused, and a STOP is said to be late."""

AHEAD_S = 1.0
"""A command cannot be from the future: then its clock is that of another start of the machine."""


def now_s() -> float:
    """The executive's clock: seconds, which only rise."""
    return time.monotonic()


def age_s(connection: HTTPConnection) -> float:
    """Seconds since a command was given; 0 if the request does not say when.

    Raises:
        ProblemError: 400, the header is no number; 409, it is from another clock.
    """
    said = connection.headers.get(GIVEN)
    if said is None:
        return 0.0
    try:
        given_s = float(said)
    except ValueError:
        given_s = math.nan
    if not math.isfinite(given_s):
        raise ProblemError(400, f"{GIVEN} is a number of seconds")
    age = now_s() - given_s
    if age < -AHEAD_S:
        raise ProblemError(
            409, f"{GIVEN} is {-age:.0f} s ahead of this executive's clock: connect again"
        )
    return max(0.0, age)


def refuse_late(connection: HTTPConnection) -> None:
    """Let a command pass that was given just now.

    Raises:
        ProblemError: 409, it arrived too late, with its age; or as `age_s`.
    """
    age = age_s(connection)
    if age > LONGEST_S:
        raise ProblemError(
            409,
            f"this was given {age:.1f} s before it arrived, and is refused after {LONGEST_S:g} s: "
            "look at what is so now, and give it again",
            age_s=round(age, 1),
            limit_s=LONGEST_S,
        )
