"""One upload of a plan, from the first request for an item to the acknowledgement."""

from dataclasses import dataclass, field

from m2pem_plugin_mavlink.sim.missions.plan import Item
from m2pem_plugin_mavlink.sim.peers import Heard


@dataclass(slots=True)
class Upload:
    """Who uploads which kind of plan, the next item, the one behind the last."""

    uploader: Heard
    kind: int
    next: int
    end: int
    asked_s: float
    heard_s: float
    items: list[Item] = field(default_factory=list)
    """Those that came, where they become the plan all at once."""

    def should_ask(self, now_s: float, after_s: float) -> bool:
        """It is time to ask again for an item that did not come."""
        return now_s - self.asked_s >= after_s

    def abandoned(self, now_s: float, after_s: float) -> bool:
        """No item has come for so long."""
        return now_s - self.heard_s > after_s
