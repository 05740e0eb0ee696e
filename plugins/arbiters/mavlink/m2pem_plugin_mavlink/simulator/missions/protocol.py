"""One upload of a plan, from the first request for an item to the acknowledgement."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem_plugin_mavlink.simulator.fence import is_whole
from m2pem_plugin_mavlink.simulator.interfaces import AutopilotInterface, Component, on_message
from m2pem_plugin_mavlink.simulator.messages import Sender
from m2pem_plugin_mavlink.simulator.missions.plan import (
    ACCEPTED,
    FENCE,
    MISSION,
    RALLY,
    Item,
    fault_of,
    item_of,
    message_of,
)


@dataclass(slots=True)
class Upload:
    """Who uploads which kind of plan of how many items, and the items that came. They become the
    plan of PX4 all at once. `marked`: the item that the ground station has marked as current."""

    uploader: Sender
    kind: int
    count: int
    asked_s: float
    received_s: float
    items: list[Item] = field(default_factory=list)
    marked: int | None = None

    @property
    def next(self) -> int:
        """The index of the item that is to come."""
        return len(self.items)


ERROR, UNSUPPORTED, NO_SPACE = 1, 3, 4
INVALID_SEQUENCE, DENIED, CANCELLED = 13, 14, 15
"""MAV_MISSION_RESULT."""
ALL = 255
"""MAV_MISSION_TYPE of a request to clear all plans."""
MOST_ITEMS: Mapping[int, int] = {MISSION: 724, FENCE: 200, RALLY: 30}
NAMES: Mapping[int, str] = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally"}
GIVE_UP_S, PX4_GIVES_UP_S = 8.0, 5.0
"""Without any item for so long, an upload is cancelled."""
ASK_AGAIN_S, PX4_ASKS_AGAIN_S = 1.0, 0.25
RECEIVED: Mapping[int, str] = {MISSION: "Flight plan received", RALLY: "Rally points received"}
KEPT_FRAMES: Mapping[int, int] = {5: 0, 6: 3, 11: 10}
"""ArduPilot keeps no difference between a MAV_FRAME and its _INT."""
TOTALS: Mapping[int, str] = {MISSION: "MIS_TOTAL", FENCE: "FENCE_TOTAL", RALLY: "RALLY_TOTAL"}
"""Parameters that count the items."""


class MissionServer(Component):
    """Takes and gives plans. One upload at a time; a second uploader is denied.

    ArduPilot's plan changes item by item, PX4's when the last item has come.
    """

    def __init__(self, autopilot: AutopilotInterface) -> None:
        super().__init__(autopilot)
        self.upload: Upload | None = None
        self._last: tuple[Sender, int, int] | None = None  # the last item of the last upload

    def step(self, dt_s: float) -> None:
        """Ask again for what did not come; give up at last."""
        upload, now_s = self.upload, self.autopilot.now_s
        if upload is None:
            return
        give_up_s = GIVE_UP_S if self._ardupilot else PX4_GIVES_UP_S
        ask_again_s = ASK_AGAIN_S if self._ardupilot else PX4_ASKS_AGAIN_S
        if now_s - upload.received_s > give_up_s:
            self.upload = None
            if self._ardupilot:
                self.autopilot.warn(f"{NAMES[upload.kind]} upload timeout")
                self._acknowledge(upload.uploader, upload.kind, CANCELLED)
            else:
                self.autopilot.warn("Mission sync timeout")
        elif now_s - upload.asked_s >= ask_again_s:
            self._ask(upload)

    @property
    def _ardupilot(self) -> bool:
        return self.autopilot.firmware.is_ardupilot

    @on_message("MISSION_COUNT")
    def _begin(self, message: Any, sender: Sender) -> None:
        kind, count = message.mission_type, message.count
        if not self._may_upload(kind, sender):
            return
        if count > MOST_ITEMS[kind]:
            self._acknowledge(sender, kind, NO_SPACE)
            return
        plans = self.autopilot.plans
        if self._ardupilot:
            plans[kind] = plans[kind][:count]
            self._counted(kind)
        if count == 0:
            self._replace(kind, (), None)
            self._complete(sender, kind)
        else:
            now_s = self.autopilot.now_s
            self.upload = Upload(sender, kind, count, now_s, now_s)
            self._ask(self.upload)

    def _may_upload(self, kind: int, sender: Sender) -> bool:
        if kind not in MOST_ITEMS:
            self._acknowledge(sender, kind, UNSUPPORTED)
            return False
        other = self.upload is not None and self.upload.uploader != sender
        if other:
            self._acknowledge(sender, kind, DENIED if self._ardupilot else ERROR)
        return not other

    def _ask(self, upload: Upload) -> None:
        upload.asked_s = self.autopilot.now_s
        make = dialect.MAVLink_mission_request_message
        if self.autopilot.firmware.asks_for_items_as_int:
            make = dialect.MAVLink_mission_request_int_message
        to = upload.uploader
        message = make(to.system, to.component, upload.next, upload.kind)
        self.autopilot.send(message, to.peer)

    @on_message("MISSION_ITEM_INT")
    def _take(self, message: Any, sender: Sender) -> None:
        upload, kind = self.upload, message.mission_type
        if upload is None or kind != upload.kind:
            again = not self._ardupilot and self._last == (sender, kind, message.seq)
            self._acknowledge(sender, kind, ACCEPTED if again else ERROR)
            return
        if message.seq != upload.next:
            if self._ardupilot:
                self._acknowledge(sender, kind, INVALID_SEQUENCE)
            return
        if sender != upload.uploader:
            self._acknowledge(sender, kind, DENIED)
            return
        item = item_of(message)
        fault = fault_of(kind, item)
        if fault != ACCEPTED:
            self.upload = None
            if not self._ardupilot:
                self.autopilot.warn("IGN MISSION_ITEM: Invalid item")
            self._acknowledge(sender, kind, fault)
            return
        if self._ardupilot:
            self.autopilot.plans.put(kind, upload.next, item)
            self._counted(kind)
        if message.current:
            upload.marked = upload.next
        upload.items.append(item)
        upload.received_s = self.autopilot.now_s
        if upload.next < upload.count:
            self._ask(upload)
        else:
            self.upload = None
            self._last = (sender, kind, message.seq)
            self._replace(kind, tuple(upload.items), upload.marked)
            self._complete(sender, kind)

    def _replace(self, kind: int, items: tuple[Item, ...], marked: int | None) -> None:
        """PX4 takes a plan as a whole, and only one that differs."""
        autopilot = self.autopilot
        if self._ardupilot or items == autopilot.plans[kind]:
            return
        autopilot.plans[kind] = items
        if kind == MISSION:
            autopilot.mission.replaced(marked)

    def _complete(self, sender: Sender, kind: int) -> None:
        autopilot = self.autopilot
        if kind == FENCE and self._ardupilot and not is_whole(autopilot.plans[kind]):
            autopilot.warn("Fence validation failed")
            self._acknowledge(sender, kind, ERROR)
            return
        self._acknowledge(sender, kind, ACCEPTED)
        if kind in RECEIVED and self._ardupilot:
            self.autopilot.say(RECEIVED[kind])
        self.autopilot.log_event("upload", f"{NAMES[kind]} {len(self.autopilot.plans[kind])}")

    def _counted(self, kind: int) -> None:
        if TOTALS[kind] in self.autopilot.parameters:
            self.autopilot.parameters[TOTALS[kind]] = len(self.autopilot.plans[kind])

    @on_message("MISSION_REQUEST_LIST")
    def _count(self, message: Any, sender: Sender) -> None:
        kind = message.mission_type
        if kind not in MOST_ITEMS:
            self._acknowledge(sender, kind, UNSUPPORTED)
        elif self.upload is not None:
            self._acknowledge(sender, kind, DENIED)
        else:
            count = len(self.autopilot.plans[kind])
            answer = dialect.MAVLink_mission_count_message(
                sender.system, sender.component, count, kind
            )
            self.autopilot.send(answer, sender.peer)

    @on_message("MISSION_REQUEST_INT")
    def _give(self, message: Any, sender: Sender) -> None:
        kind, seq, autopilot = message.mission_type, message.seq, self.autopilot
        if kind not in MOST_ITEMS:
            self._acknowledge(sender, kind, UNSUPPORTED)
            return
        if seq >= len(autopilot.plans[kind]):
            self._acknowledge(sender, kind, INVALID_SEQUENCE)
            return
        item = autopilot.plans[kind][seq]
        if kind == MISSION and seq == 0 and self._ardupilot:
            item = self._home()
        if self._ardupilot:
            item = item._replace(frame=KEPT_FRAMES.get(item.frame, item.frame))
        current = kind == MISSION and seq == autopilot.mission.current
        to = (sender.system, sender.component)
        autopilot.send(message_of(item, seq, kind, current=current, to=to), sender.peer)

    def _home(self) -> Item:
        """Item 0 is the home position, whatever was uploaded there."""
        autopilot = self.autopilot
        place = autopilot.frame.to_location(autopilot.home.point)
        return Item(0, 16, 0, 0, 0, 0, *place.scaled[:2], round(place.altitude_amsl_m, 2))

    @on_message("MISSION_CLEAR_ALL")
    def _clear(self, message: Any, sender: Sender) -> None:
        """ArduPilot does not clear a mission that is being flown."""
        kind, autopilot = message.mission_type, self.autopilot
        kinds = tuple(MOST_ITEMS) if kind == ALL else (kind,)
        if kind != ALL and kind not in MOST_ITEMS:
            self._acknowledge(sender, kind, UNSUPPORTED)
        elif self.upload is not None:
            self._acknowledge(sender, kind, DENIED)
        elif (
            self._ardupilot
            and MISSION in kinds
            and autopilot.mission.running
            and autopilot.arming.armed
        ):
            self._acknowledge(sender, kind, ERROR)
        else:
            for each in kinds:
                autopilot.plans[each] = ()
                self._counted(each)
            self._acknowledge(sender, kind, ACCEPTED)
            if MISSION in kinds:
                autopilot.mission.clear()

    @on_message("MISSION_ACK")
    def _acknowledged(self, message: Any, sender: Sender) -> None:
        """The end of a download, or an uploader that gives up."""
        upload = self.upload
        if message.type == CANCELLED and upload is not None and upload.uploader == sender:
            self.upload = None

    def _acknowledge(self, to: Sender, kind: int, result: int) -> None:
        message = dialect.MAVLink_mission_ack_message(to.system, to.component, result, kind)
        self.autopilot.send(message, to.peer)
