"""Which of the shared behaviors a simulated vehicle or payload can do."""

from collections.abc import Mapping

from m2pem.fleet.behaviors import SHARED
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorSpec

_EVERYWHERE = frozenset(
    {
        "single_vehicle_routing",
        "goto",
        "hold",
        "drive_stop",
        "return_to_launch",
        "area_survey",
        "orbit",
        "area_observe",
        "follow",
        "teleop",
        "set_speed",
        "deploy",
    }
)
_BY_DOMAIN: Mapping[str, frozenset[str]] = {
    "ground": _EVERYWHERE | {"reverse"},
    "air": _EVERYWHERE | {"takeoff", "land", "change_altitude"},
    "surface": _EVERYWHERE | {"reverse"},
    "subsurface": _EVERYWHERE | {"reverse", "change_altitude"},
}
_PICTURES = frozenset({"zoom", "take_picture", "record_video"})
_BY_KIND: Mapping[str, frozenset[str]] = {
    "camera": _PICTURES,
    "ptz": _PICTURES | {"ptz_point_at", "ptz_scan_polygon", "ptz_scan_sector", "ptz_track"},
    "gpr": frozenset(),
}


def vehicle_behaviors(domain: str) -> tuple[BehaviorSpec, ...]:
    """What a vehicle of the domain can do alone. Teams are made of that, as everywhere."""
    alone = _BY_DOMAIN.get(domain, _BY_DOMAIN["ground"])
    return tuple(
        spec
        for (name, type_), spec in SHARED.items()
        if type_ is BehaviorType.VEHICLE and name in alone
    )


def payload_behaviors(kind: str) -> tuple[BehaviorSpec, ...]:
    """What a payload can do; of no kind: all that payloads can."""
    names = _BY_KIND.get(kind)
    return tuple(
        spec
        for (name, type_), spec in SHARED.items()
        if type_ is BehaviorType.PAYLOAD and (names is None or name in names)
    )
