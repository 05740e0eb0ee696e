"""Sees a base leave the fence."""

from collections.abc import Callable

from m2pem_plugin_ros.pilot.plane import Place

STRAY_M = 1.0
"""So far outside is not left yet: a way may run along the fence, and a base swings out a little."""


class FenceWatch:
    """During one motion. Who was outside when that began may come back.

    `outside_m`: how far a place is from where one may be; 0 inside.
    """

    def __init__(self, outside_m: Callable[[Place], float]) -> None:
        self._outside_m = outside_m
        self._was_inside = False

    def forget(self) -> None:
        """Another motion begins."""
        self._was_inside = False

    def left_by_m(self, place: Place) -> float:
        """How far outside who is at a place has gone; 0 if it has not."""
        by_m = self._outside_m(place)
        if by_m <= STRAY_M:
            self._was_inside = True
            return 0.0
        return by_m if self._was_inside else 0.0
