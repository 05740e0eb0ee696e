"""What goes wrong in a simulated Nav2, on request."""

from dataclasses import dataclass


@dataclass(slots=True)
class Faults:
    """`reject`: no goal is accepted. `hang`: goals are accepted, and nothing is done for them; they
    cannot be cancelled either. `error_code`: goals are aborted with it after `abort_after_s`.
    `miss`: waypoints with these indices are not reached."""

    reject: bool = False
    hang: bool = False
    error_code: int = 0
    error_msg: str = ""
    abort_after_s: float = 0.5
    miss: frozenset[int] = frozenset()
