"""To look over a sector of headings, once."""

import math

from m2pem_plugin_ptz.behaviors.sweeping import Sweeping

_PROBES = 72


class ScanSector(Sweeping):
    """From one edge to the other, beginning with the nearer one. The sector stays where it is in
    the world while the vehicle turns."""

    name = "ptz_scan_sector"

    def refusal(self) -> str:
        """It must be able to have each heading of the sector in the picture."""
        if reason := self.needs_heading():
            return reason
        deck, middle, half = self.sight.deck(self.sight.now_us), *self._sector()
        elevation = self._elevation()
        for index in range(_PROBES + 1):
            heading = middle - half + 2 * half * index / _PROBES
            turn = self.sight.turn(*deck.towards(heading, elevation))
            if turn.missing_rad > self.seen_rad():
                return f"heading {math.degrees(heading) % 360:.0f} deg is out of reach: {turn.why}"
        return ""

    async def begin(self) -> None:
        """Choose the edge to begin with."""
        middle, half = self._sector()
        elevation = self._elevation()
        here, _ = self.heading()
        away = math.remainder(here - middle, math.tau)
        near = math.copysign(half, away)
        if half > math.pi - 1e-6:
            self.set_out(here, here + math.tau, elevation)  # all round, from where it looks
            return
        self.set_out(middle + near, middle - near, elevation)

    async def step(self, elapsed_s: float) -> bool:
        """Done at the other edge."""
        return self.sweep(elapsed_s)

    def _sector(self) -> tuple[float, float]:
        return self.job.number("heading") or 0.0, (self.job.number("sector") or 0.0) / 2

    def _elevation(self) -> float:
        """As the mission says, else as it looks."""
        wished = self.job.number("elevation")
        if wished is not None or self.driver.look is None:
            return wished or 0.0
        return self.heading()[1]
