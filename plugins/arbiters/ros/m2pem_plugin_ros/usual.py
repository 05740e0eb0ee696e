"""What a behavior's parameters are where the mission does not say, however a vehicle is reached."""

import math

REVERSE_M = 5.0

OFFSET_M = 15.0
BEHIND_RAD = math.pi
"""Where a vehicle follows another one, from its bow clockwise."""
