"""How a fence is set up, whatever the firmware calls its parameters."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FenceRules:
    """`zones`: the uploaded shapes hold; heights and radius are from home, None: no limit; `mode`:
    which is entered at a breach, None: none; `text`: said then, with the name of what was breached.
    """

    enabled: bool
    zones: bool = True
    highest_m: float | None = None
    lowest_m: float | None = None
    radius_m: float | None = None
    mode: int | None = None
    text: str = "{} fence breached"
