"""Serves ground stations: what they send goes to whom it concerns, and they get what there is."""

import asyncio
from collections import OrderedDict
from contextlib import ExitStack, suppress

from pymavlink.dialects.v20 import ardupilotmega as dialect

from m2pem.api import (
    PRESENCE_EVERY_S,
    Connection,
    EventThrower,
    MissionControl,
    PayloadState,
    ResourceId,
    ThrownEvents,
    VehicleState,
    follow,
)
from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.face.commands import (
    POSITION_TARGET,
    Command,
    RefusedCommandError,
    command_of,
    position_order,
)
from m2pem_plugin_mavlink.face.components import cameras_of
from m2pem_plugin_mavlink.face.event_settings import EventRules
from m2pem_plugin_mavlink.face.events import Events
from m2pem_plugin_mavlink.face.forwarding import COMMAND_INT, COMMAND_LONG, Forwarder
from m2pem_plugin_mavlink.face.orders import Orders
from m2pem_plugin_mavlink.face.plan_runs import PlanRuns
from m2pem_plugin_mavlink.face.received_messages import MessageReceiver
from m2pem_plugin_mavlink.face.requests import (
    Request,
    Requests,
    acknowledgement,
    name_of,
    refusals_of,
)
from m2pem_plugin_mavlink.face.sent_messages import MessageSender
from m2pem_plugin_mavlink.face.settings import Settings, own_system
from m2pem_plugin_mavlink.face.stations import Station, Stations
from m2pem_plugin_mavlink.face.streams import Streams
from m2pem_plugin_mavlink.face.telemetry import TYPES
from m2pem_plugin_mavlink.face.texts import TextSeverity, status_texts
from m2pem_plugin_mavlink.face.vehicle import AUTOPILOT, Camera, ShownVehicle
from m2pem_plugin_mavlink.link.hub import shared_hub
from m2pem_plugin_mavlink.link.route import Peer
from m2pem_plugin_mavlink.link.vehicle_link import VehicleLink
from m2pem_plugin_mavlink.microservices.commands import message_name
from m2pem_plugin_mavlink.protocol.messages import Address, Message, message_type, types_by_id
from m2pem_plugin_mavlink.protocol.raw_frames import RawFrame
from m2pem_plugin_mavlink.settings import GCS_SYSTEM_ID

ONBOARD_COMPUTER: int = dialect.MAV_COMP_ID_ONBOARD_COMPUTER
"""m2pem speaks as it for a forwarded vehicle, whose autopilot numbers its own frames."""

SAID_AGAIN_S = 5.0
"""Seconds after which a station is told the same again."""

MOST_SAID = 256
LEAST_WAITING = 100
STATES_PER_VEHICLE = 4

DATA_STREAM: int = dialect.MAVLINK_MSG_ID_REQUEST_DATA_STREAM
FILE_TRANSFER: int = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
PARAM_SET: int = dialect.MAVLINK_MSG_ID_PARAM_SET

SET_MODE: int = dialect.MAVLINK_MSG_ID_SET_MODE
_NO_REQUEST = frozenset(
    getattr(dialect, f"MAVLINK_MSG_ID_{name}")
    for name in ("HEARTBEAT", "SYSTEM_TIME", "COMMAND_ACK", "LOG_REQUEST_END")
)
_TARGETS = (
    POSITION_TARGET,
    dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    dialect.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
)
_INSTEAD = {
    **dict.fromkeys(
        ("SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET"),
        ": send SET_POSITION_TARGET_GLOBAL_INT or DO_REPOSITION",
    ),
    **dict.fromkeys(
        ("GIMBAL_MANAGER_SET_ATTITUDE", "GIMBAL_MANAGER_SET_PITCHYAW"),
        ": send DO_GIMBAL_MANAGER_PITCHYAW with angles",
    ),
}
"""What does the same as a message that is not carried out."""

_CLOCK_REQUESTS = (dialect.MAVLINK_MSG_ID_PING, dialect.MAVLINK_MSG_ID_TIMESYNC)
"""They go to all vehicles."""


class FaceServer:
    """Every vehicle of the fleet as a MAVLink system: shown by m2pem, or forwarded."""

    def __init__(
        self,
        control: MissionControl,
        settings: Settings,
        rules: EventRules,
        thrown: ThrownEvents | None,
    ) -> None:
        """`thrown`: what missions throw that a rule of `rules` is about; None: there is no such
        rule."""
        fleet = control.fleet()
        self._rules = rules
        self._thrown = thrown
        self._control = control
        self._settings = settings
        behaviors = {
            resource: frozenset(spec.name for spec in specs)
            for resource, specs in control.catalogue().items()
        }
        self._vehicles = {
            name: ShownVehicle(
                name,
                str(fleet.vehicles[name].domain),
                system,
                behaviors.get(name, frozenset()),
                cameras_of(name, fleet, behaviors),
                type=TYPES.get(fleet.vehicles[name].domain, dialect.MAV_TYPE_GENERIC),
                fence=Connection.of(fleet, name).fence,
                arms_itself=fleet.vehicles[name].arbiter == "mavlink",
            )
            for name, system in self._settings.systems.items()
            if name not in self._settings.forwarded
        }
        self._by_system = {each.system: each for each in self._vehicles.values()}
        self._cameras: dict[ResourceId, Camera] = {
            camera.resource: camera for each in self._vehicles.values() for camera in each.cameras
        }
        self._types = ExitStack()
        self._said: OrderedDict[tuple[Peer, int, str], float] = OrderedDict()
        systems = frozenset(self._settings.systems.values())
        links = {
            url: frozenset(self._settings.systems[each] for each in vehicles)
            for url, vehicles in self._settings.links.items()
        }
        self._stations = Stations(self._settings.urls, systems, self._receive, links)
        self._streams = Streams(
            self._stations,
            list(self._vehicles.values()),
            self._settings.rates_hz,
            self._stations.now_s,
        )
        self._requests = Requests(self._streams, fleet, self._tell)
        self._plans = PlanRuns(control, self._tell, self._send)
        self._orders = Orders(
            control, self._settings.commands, self._plans, self._tell, self._stations.now_s
        )
        self._events = Events(self._vehicles, control, self._orders, self._plans, self._say)

    async def serve(self) -> None:
        """Serve ground stations until cancelled.

        Raises:
            PluginError: an endpoint cannot be opened.
        """
        forwarded = {self._settings.systems[name]: name for name in self._settings.forwarded}
        in_fleet = self._control.fleet().vehicles
        self._forwarder = Forwarder(
            shared_hub(),
            self._stations,
            forwarded,
            self._settings.forwarded_commands,
            {
                in_fleet[name].settings.get("gcs_system_id", GCS_SYSTEM_ID)
                for name in self._settings.forwarded
            },
            self._refuse_forwarding,
        )
        autopilots = {
            name: Address(own, AUTOPILOT)
            for name, vehicle in in_fleet.items()
            if (own := own_system(vehicle.settings)) is not None
        }
        await self._plans.take_up(self._vehicles.values())
        thrower = EventThrower(self._control)
        vehicles = {address: name for name, address in autopilots.items()}
        self._receiver = MessageReceiver(shared_hub(), self._rules.received, vehicles, thrower)
        await self._stations.open()
        self._forwarder.open()
        self._receiver.open()
        shared_hub().link_watchers.append(self._watch_type)
        for link in shared_hub().links:
            self._watch_type(link)
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self._follow_telemetry())
                group.create_task(follow(self._control, self._events).run())
                group.create_task(self._events.follow_holders(self._control))
                group.create_task(self._stations.maintain())
                group.create_task(self._streams.run())
                group.create_task(self._announce_holders())
                group.create_task(thrower.run())
                if self._thrown is not None:
                    sender = MessageSender(
                        shared_hub(), self._stations, self._control, autopilots, self._sources()
                    )
                    sent = {each.rule: each for each in self._rules.sent}
                    group.create_task(sender.run(self._thrown, sent))
        finally:
            shared_hub().link_watchers.remove(self._watch_type)
            self._types.close()
            self._receiver.close()
            self._forwarder.close()
            await self._orders.close()
            await self._stations.close()

    def _watch_type(self, link: VehicleLink) -> None:
        """Show a MAVLink vehicle as the MAV_TYPE that it has itself, such as a plane."""
        vehicle = self._by_system.get(link.address.system)

        def learn(message: Message, sender: Address) -> None:
            if vehicle is not None and sender == link.address:
                vehicle.type = message.type

        self._types.callback(link.listen({dialect.MAVLINK_MSG_ID_HEARTBEAT}, learn))

    async def _announce_holders(self) -> None:
        """Announce the stations that have vehicles as present, for as long as they are received."""
        while True:
            with suppress(M2pemError):
                have = set((await self._control.holders()).values())
                for station in list(self._stations):
                    for each in sorted(station.addresses):
                        if (by := name_of(each, station)) in have:
                            await self._control.announce_presence(by, unit="mavlink", by=by)
            await asyncio.sleep(PRESENCE_EVERY_S)

    def _sources(self) -> dict[ResourceId, Address]:
        """Return in whose name m2pem tells ground stations about each vehicle."""
        forwarded = self._settings.forwarded
        return {
            name: Address(system, ONBOARD_COMPUTER if name in forwarded else AUTOPILOT)
            for name, system in self._settings.systems.items()
        }

    async def _follow_telemetry(self) -> None:
        size = max(LEAST_WAITING, STATES_PER_VEHICLE * len(self._vehicles))
        async for state in self._control.telemetry(size=size):
            if isinstance(state, VehicleState):
                vehicle = self._vehicles.get(state.resource)
                if vehicle is not None:
                    vehicle.update(state, self._stations.now_s())
                    self._plans.progress(vehicle)
            elif isinstance(state, PayloadState):
                camera = self._cameras.get(state.resource)
                if camera is not None:
                    camera.state = state

    # --- what stations send -----------------------------------------------------------------------

    def _receive(self, station: Station, frame: RawFrame) -> None:
        self._forwarder.from_station(station, frame)
        self._receiver.from_station(frame)
        type_ = types_by_id().get(frame.id)
        if type_ is not None and frame.id in _CLOCK_REQUESTS:
            message = type_.unpack(frame.payload)
            self._requests.clock(message, frame.source, station, self._vehicles.values())
            return
        if type_ is not None and frame.id == COMMAND_LONG and not frame.target.system:
            self._broadcast(type_.unpack(frame.payload), station, frame)
            return
        vehicle = self._by_system.get(frame.target.system)
        if type_ is None or vehicle is None or frame.id in _NO_REQUEST:
            return
        if not station.shows(vehicle.system):
            return
        component = frame.target.component or AUTOPILOT
        camera = next((each for each in vehicle.cameras if each.component == component), None)
        if component != AUTOPILOT and camera is None:
            return
        message = type_.unpack(frame.payload)
        request = Request(message, frame.source, station, vehicle, camera)
        station.sends_targets |= frame.id in _TARGETS
        if frame.id in (COMMAND_LONG, COMMAND_INT):
            may_be_px4s = station.sends_targets and not station.ardupilot_modes
            self._command(command_of(message, frame, may_be_px4s=may_be_px4s), request)
        elif frame.id == SET_MODE:  # its number is whole: below 256, it is ArduPilot's
            is_custom = message.base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            params = float(is_custom), float(message.custom_mode), 0.0, 0.0
            mode = Command(dialect.MAV_CMD_DO_SET_MODE, params, None, 0.0, "", 0)
            self._orders.command(mode, request)
        elif camera is not None:
            return  # cameras have neither parameters nor a plan
        elif frame.id == POSITION_TARGET:
            try:
                order = position_order(message, vehicle)
            except RefusedCommandError as error:
                self._tell(station, vehicle, error.reason)
            else:
                if order is not None:
                    self._orders.target(order, request)
        elif not (self._orders.upload(request) or self._requests.message(request)):
            advice = _INSTEAD.get(type_.name, "")
            self._tell(station, vehicle, f"{type_.name} is not carried out{advice}")

    def _broadcast(self, message: Message, station: Station, frame: RawFrame) -> None:
        """Answer a command to all that only asks, for each vehicle; each answer counts as a frame
        of the station."""
        for vehicle in self._vehicles.values():
            if not (vehicle.present and station.shows(vehicle.system)):
                continue
            if not station.may_send(self._stations.now_s()):
                return
            request = Request(message, frame.source, station, vehicle, None)
            command = command_of(message, frame)
            if (result := self._requests.command(command, request)) is not None:
                request.answer(acknowledgement(command.id, result, request.source))

    def _command(self, command: Command, request: Request) -> None:
        result = self._requests.command(command, request)
        if result is None:
            self._orders.command(command, request)
        else:
            request.answer(acknowledgement(command.id, result, request.source))

    # --- what stations are told -------------------------------------------------------------------

    def _say(self, vehicle: ShownVehicle, severity: TextSeverity, text: str) -> None:
        """Send a text to all stations."""
        for message in status_texts(text, severity):
            self._send(vehicle, message)

    def _send(self, vehicle: ShownVehicle, message: Message) -> None:
        """Send a message of a vehicle to all stations."""
        for station in self._stations:
            station.send(message, vehicle.autopilot)

    def _tell(self, station: Station, vehicle: ShownVehicle, text: str) -> None:
        """Tell one station why something is refused."""
        self._tell_as(station, vehicle.autopilot, f"{vehicle.resource}: {text}")

    def _tell_as(self, station: Station, source: Address, text: str) -> None:
        now_s = self._stations.now_s()
        key = station.peer, source.system, text
        if now_s - self._said.get(key, -SAID_AGAIN_S) < SAID_AGAIN_S:
            return
        self._said[key] = now_s
        self._said.move_to_end(key)
        while len(self._said) > MOST_SAID:
            self._said.popitem(last=False)
        for message in status_texts(text, TextSeverity.WARNING):
            station.send(message, source)

    def _refuse_forwarding(self, station: Station, frame: RawFrame, system: int) -> None:
        """Refuse a command to a forwarded vehicle."""
        if not frame.target.system:
            return
        to = Address(system, frame.target.component or AUTOPILOT)
        type_ = types_by_id().get(frame.id)
        message = type_.unpack(frame.payload) if type_ is not None else None
        for refusal in refusals_of(message, frame.source) if message is not None else ():
            station.send(refusal, to)
        if message is not None and frame.id == PARAM_SET:
            # The vehicle's answer, which all stations get, is the value that it keeps.
            make = message_type("PARAM_REQUEST_READ").make
            asks = make(**to.as_target, param_id=message.param_id, param_index=-1)
            for link in shared_hub().links:
                if link.address.system == system:
                    link.send(asks)
        if frame.id == FILE_TRANSFER:
            return
        if frame.id != DATA_STREAM:  # MAVProxy sends it every 10 s
            name = next(each for each, id_ in self._settings.systems.items() if id_ == system)
            what = message_name(frame.id)
            text = f"{name}: {what} is not forwarded: faces.mavlink.forward_commands"
            self._tell_as(station, Address(system, ONBOARD_COMPUTER), text)
