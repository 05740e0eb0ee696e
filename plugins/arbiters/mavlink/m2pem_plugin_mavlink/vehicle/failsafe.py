"""Compares the failsafe in the fleet file with the parameters of the vehicle, again and again.

Sources: the parameter references of ArduPilot (FS_*, BATT_FS_*, RTL_ALT, MAV_GCS_SYSID) and PX4
(NAV_DLL_ACT, COM_LOW_BAT_ACT, RTL_RETURN_ALT). Nothing is changed: findings say what to set.
"""

import asyncio
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from m2pem.api import ResourceId
from m2pem_plugin_mavlink.microservices.parameters import (
    PARAM_VALUE,
    ReadParameter,
    encoded_name,
    value_of,
)
from m2pem_plugin_mavlink.protocol.messages import Address, Message
from m2pem_plugin_mavlink.protocol.transaction import ExchangeError
from m2pem_plugin_mavlink.vehicle.identity import ON_THE_GROUND, Firmware, Identity, Kind
from m2pem_plugin_mavlink.vehicle.vehicle import Vehicle

AGAIN_S = 60.0
"""Some autopilots report no parameter that is set elsewhere: they are read again."""

SETTLES_S = 2.0

RETURN, LAND, HOLD, CONTINUE = "return_to_launch", "land", "hold", "continue"
WORDS = (RETURN, LAND, HOLD, CONTINUE)
"""What a fleet's `failsafe` may be for a MAVLink vehicle."""

Values = Mapping[str, float]
"""Parameters of a vehicle, by name; one that it does not have is left out."""


@dataclass(frozen=True, slots=True)
class FailsafeFinding:
    """A difference between the fleet file and the vehicle. `parameter`: the one to set, "" if the
    fleet file is wrong; `text` is for people, and says what would be right."""

    resource: ResourceId
    parameter: str
    text: str

    def __str__(self) -> str:
        return f"{self.resource}: {self.text}"


@dataclass(frozen=True, slots=True)
class _Setting:
    """A parameter whose values are actions: the values that fit each word of the fleet file (the
    one to set comes first), and the meanings of all values."""

    names: tuple[str, ...]
    fits: Mapping[str, tuple[int, ...]]
    meanings: Mapping[int, str]

    def value(self, values: Values) -> tuple[str, int] | None:
        """Return its name on this vehicle (firmware releases renamed it) and its value."""
        for name in self.names:
            if name in values:
                return name, round(values[name])
        return None

    def meaning(self, value: int) -> str:
        return self.meanings.get(value, "unknown to m2pem")


_COPTER_ACTIONS = {
    1: "return to launch",
    2: "return to launch, or go on with the mission",
    3: "SmartRTL, else return to launch",
    4: "SmartRTL, else land",
    5: "land",
    6: "landing sequence of the mission, else return to launch",
    7: "brake, else land",
}
_COPTER_GCS = _Setting(
    ("FS_GCS_ENABLE",),
    {RETURN: (1, 3, 6), LAND: (5,), HOLD: (7,), CONTINUE: (0,)},
    {0: "disabled", **_COPTER_ACTIONS},
)
_COPTER_RC = _Setting(
    ("FS_THR_ENABLE",),
    {RETURN: (1, 4, 6), LAND: (3,), HOLD: (7,)},
    {**_COPTER_ACTIONS, 3: "land", 4: "SmartRTL, else return to launch", 5: "SmartRTL, else land"},
)
"""On loss of the remote control. Its numbers are not those of FS_GCS_ENABLE."""
_PLANE_ENABLE = _Setting(
    ("FS_GCS_ENABL",),
    {RETURN: (1, 2), LAND: (1, 2), CONTINUE: (0,)},
    {0: "disabled", 1: "heartbeat", 2: "heartbeat and radio", 3: "heartbeat, in AUTO only"},
)
_PLANE_ACTION = _Setting(
    ("FS_LONG_ACTN",),
    {RETURN: (1,), LAND: (5,), CONTINUE: (0,)},
    {0: "go on", 1: "return to launch", 2: "glide", 3: "parachute", 4: "AUTO", 5: "AUTOLAND"},
)
_ROVER_ENABLE = _Setting(
    ("FS_GCS_ENABLE",),
    {RETURN: (1,), HOLD: (1,), CONTINUE: (0,)},
    {0: "disabled", 1: "enabled", 2: "enabled, but not in AUTO"},
)
_ROVER_ACTION = _Setting(
    ("FS_ACTION",),
    {RETURN: (1, 3, 4), HOLD: (2, 6), CONTINUE: (0,)},
    {
        0: "nothing",
        1: "return to launch",
        2: "hold",
        3: "SmartRTL, else return to launch",
        4: "SmartRTL, else hold",
        5: "terminate",
        6: "loiter, else hold",
    },
)
_SUB_GCS = _Setting(
    ("FS_GCS_ENABLE",),
    {HOLD: (3,), CONTINUE: (0, 1), LAND: (4,)},
    {0: "disabled", 1: "warn", 2: "disarm", 3: "hold the depth", 4: "surface"},
)
_PX4_LINK = _Setting(
    ("NAV_DLL_ACT",),
    {RETURN: (2,), LAND: (3,), HOLD: (1,), CONTINUE: (0,)},
    {0: "disabled", 1: "hold", 2: "return", 3: "land", 5: "terminate", 6: "disarm"},
)
_LINK: Mapping[tuple[Firmware, Kind], tuple[_Setting, ...]] = {
    (Firmware.ARDUPILOT, Kind.COPTER): (_COPTER_GCS,),
    (Firmware.ARDUPILOT, Kind.PLANE): (_PLANE_ENABLE, _PLANE_ACTION),
    (Firmware.ARDUPILOT, Kind.VTOL): (_PLANE_ENABLE, _PLANE_ACTION),
    (Firmware.ARDUPILOT, Kind.ROVER): (_ROVER_ENABLE, _ROVER_ACTION),
    (Firmware.ARDUPILOT, Kind.BOAT): (_ROVER_ENABLE, _ROVER_ACTION),
    (Firmware.ARDUPILOT, Kind.SUB): (_SUB_GCS,),
    **{(Firmware.PX4, kind): (_PX4_LINK,) for kind in Kind},
}
_BATTERY = {Firmware.ARDUPILOT: "BATT_FS_LOW_ACT", Firmware.PX4: "COM_LOW_BAT_ACT"}
_OUR_STATION = ("MAV_GCS_SYSID", "SYSID_MYGCS")
_RETURN_HEIGHT = ("RTL_ALT_M", "RTL_ALT")
_PILOT = _COPTER_RC.names[0]
_GOES_ON_IN_AUTO = 1 << 1
_STAYS_WHERE_HELD = 1 << 4
"""FS_OPTIONS of ArduCopter. The second one, "continue if in pilot control", is its default. BRAKE
and LOITER, in which m2pem holds a copter, count as controlled by a pilot."""


def parameters_of_interest(identity: Identity) -> tuple[str, ...]:
    """Return the names of the parameters that `findings` compares; a vehicle does not have all of
    them."""
    link = [name for each in _LINK[identity.firmware, identity.kind] for name in each.names]
    battery = _BATTERY[identity.firmware]
    if identity.firmware is Firmware.PX4:
        return (*link, battery)
    rest: list[str] = [*_OUR_STATION]
    if identity.kind is Kind.COPTER:
        rest += [_PILOT, "FS_OPTIONS", *_RETURN_HEIGHT]
    return (*link, battery, *rest)


def link_parameters(word: str, identity: Identity, own_system: int) -> dict[str, float]:
    """Return the parameters that make a vehicle execute the fleet's `failsafe` when its link is
    lost; none for a word that a vehicle of this kind cannot execute. ArduPilot ignores a name that
    it does not have. `own_system`: the system id of the ground station whose loss counts."""
    parameters: dict[str, float] = {}
    for setting in _LINK[identity.firmware, identity.kind]:
        if word not in setting.fits:
            return {}
        parameters.update(dict.fromkeys(setting.names, float(setting.fits[word][0])))
        if word == CONTINUE:  # the failsafe is off: its action does not matter
            break
    if parameters and identity.firmware is Firmware.ARDUPILOT:
        parameters.update(dict.fromkeys(_OUR_STATION, float(own_system)))
        if identity.kind is Kind.COPTER and word in (RETURN, LAND):
            parameters["FS_OPTIONS"] = 0.0  # also while it is held
    return parameters


def findings(
    resource: ResourceId,
    word: str,
    identity: Identity,
    values: Values,
    own_system: int | None = None,
) -> tuple[FailsafeFinding, ...]:
    """Return the differences between a vehicle's parameters and the `failsafe` of its fleet; "" has
    none. `own_system`: the system id that this arbiter sends with."""
    if not word:
        return ()
    if word not in WORDS:
        text = f"failsafe '{word}' is not known for MAVLink vehicles; known: {', '.join(WORDS)}"
        return (FailsafeFinding(resource, "", text),)
    found = [*_link_findings(word, identity, values)]
    if word != CONTINUE:
        found += _station_findings(identity, values, own_system)
    found += _battery_findings(identity, values)
    if identity == Identity(Firmware.ARDUPILOT, Kind.COPTER):
        found += _copter_findings(word, values)
    return tuple(FailsafeFinding(resource, parameter, text) for parameter, text in found)


_Found = Iterator[tuple[str, str]]


def _link_findings(word: str, identity: Identity, values: Values) -> _Found:
    for setting in _LINK[identity.firmware, identity.kind]:
        fits = setting.fits.get(word)
        if fits is None:
            yield "", f"fleet says {word} on loss of link, which no {identity} supports"
            return
        has = setting.value(values)
        if has is None:
            name = setting.names[0]
            yield name, f"fleet says {word} on loss of link; {name} could not be read"
        elif has[1] not in fits:
            name, value = has
            yield (
                name,
                f"fleet says {word} on loss of link, {name} is {value} ({setting.meaning(value)}): "
                f"set it to {fits[0]}",
            )
        elif word == CONTINUE and setting is not _PLANE_ACTION and setting is not _ROVER_ACTION:
            return  # the failsafe is off: its action does not matter


def _station_findings(identity: Identity, values: Values, own_system: int | None) -> _Found:
    """Check the ground station that ArduPilot monitors: it monitors the heartbeats of one alone."""
    if identity.firmware is not Firmware.ARDUPILOT or own_system is None:
        return
    for name in _OUR_STATION:
        if name in values and round(values[name]) != own_system:
            yield (
                name,
                f"its failsafe monitors the ground station with system id {values[name]:.0f} "
                f"({name}), m2pem has {own_system}: set one of them to the other",
            )


def _battery_findings(identity: Identity, values: Values) -> _Found:
    name = _BATTERY[identity.firmware]
    if name in values and round(values[name]) == 0 and identity.kind not in ON_THE_GROUND:
        only = "it only warns" if identity.firmware is Firmware.PX4 else "nothing happens"
        yield name, f"{only} when its battery is low, {name} is 0: set it to 2 or 3"


def _copter_findings(word: str, values: Values) -> _Found:
    options = round(values.get("FS_OPTIONS", 0.0))
    if word != CONTINUE and options & _GOES_ON_IN_AUTO:
        yield (
            "FS_OPTIONS",
            f"fleet says {word} on loss of link, FS_OPTIONS is {options}: in AUTO it goes on; "
            f"set it to {options & ~_GOES_ON_IN_AUTO & ~_STAYS_WHERE_HELD}",
        )
    elif word in (RETURN, LAND) and options & _STAYS_WHERE_HELD:
        yield (
            "FS_OPTIONS",
            f"fleet says {word} on loss of link, FS_OPTIONS is {options}: while it is held (BRAKE, "
            "LOITER) it stays in the air until its battery is low; "
            f"set it to {options & ~_STAYS_WHERE_HELD}",
        )
    pilot = values.get(_PILOT)
    if word != CONTINUE and pilot is not None and round(pilot) in _COPTER_RC.meanings:
        value = round(pilot)
        if value not in _COPTER_RC.fits[word]:
            yield (
                _PILOT,
                f"fleet says {word} on loss of link, on loss of its remote control {_PILOT} is "
                f"{value} ({_COPTER_RC.meanings[value]})",
            )
    if word != RETURN:
        return
    for name in _RETURN_HEIGHT:
        if name in values and values[name] == 0.0:
            yield name, f"{name} is 0: it returns at the height that it has; set a height"


class FailsafeMonitor:
    """Compares the failsafes of an identified vehicle, and again when they may have changed.

    Parameters that the vehicle does not have are requested only once: it answers each request with
    silence, after which the request is repeated.
    """

    def __init__(self, vehicle: Vehicle, word: str, own_system: int | None) -> None:
        self._vehicle = vehicle
        self._word = word
        self._own_system = own_system
        self._values: dict[str, float] = {}
        self._missing: set[str] = set()

    async def findings(self) -> tuple[FailsafeFinding, ...]:
        """Read the parameters of an identified vehicle, and compare; an unanswered one is among the
        findings. A value that was read before is used where no answer comes."""
        vehicle, identity = self._vehicle, self._vehicle.identity
        if not self._word or identity is None:
            return ()
        link, encoding = vehicle.link, identity.firmware.encoding

        async def read(name: str) -> None:
            try:
                value = await link.perform(ReadParameter(link.address, name, encoding))
            except ExchangeError:
                if name not in self._values:
                    self._missing.add(name)
            else:
                self._values[name] = value

        names = parameters_of_interest(identity)
        await asyncio.gather(*(read(name) for name in names if name not in self._missing))
        return findings(vehicle.resource, self._word, identity, self._values, self._own_system)

    async def wait_for_change(self, within_s: float = AGAIN_S) -> None:
        """Wait until the vehicle reports another value of one of the parameters, as it does when
        a person or program sets one, or `within_s`, by the arbiter's clock."""
        vehicle, identity = self._vehicle, self._vehicle.identity
        if identity is None:
            return
        names = {encoded_name(name): name for name in parameters_of_interest(identity)}
        encoding = identity.firmware.encoding
        changed = False

        def receive(message: Message, sender: Address) -> None:
            nonlocal changed
            name = names.get(message.param_id)
            if name is None or sender != vehicle.link.address:
                return
            value, known = value_of(message, encoding), self._values.get(name)
            if value != known and not math.isnan(value):
                self._missing.discard(name)
                changed = True

        stop_listening = vehicle.link.listen((PARAM_VALUE,), receive)
        try:
            await vehicle.until(lambda: changed, within_s)
            # A station that sends parameters sets several: they are read together.
            await vehicle.sleep(SETTLES_S)
        finally:
            stop_listening()
