"""One upload of a plan, from the first request for an item to the acknowledgement."""

from dataclasses import dataclass

from m2pem_plugin_mavlink.sim.peers import Heard

REQUEST_S = 1.0
"""An item that did not come is asked for again after that."""
GIVE_UP_S = 8.0
"""Without any item for so long, the upload is cancelled."""


@dataclass(slots=True)
class Upload:
    """Who uploads which kind of plan, the next item, the one behind the last."""

    uploader: Heard
    kind: int
    next: int
    end: int
    asked_s: float
    heard_s: float

    def should_ask(self, now_s: float) -> bool:
        """It is time to ask again."""
        return now_s - self.asked_s >= REQUEST_S

    def abandoned(self, now_s: float) -> bool:
        """The uploader has gone."""
        return now_s - self.heard_s > GIVE_UP_S
