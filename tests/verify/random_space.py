"""Random missions of rovers that share a bridge and a yard, in the tests' notation."""

from random import Random

from m2pem.deconfliction.known_ways import FleetWays
from m2pem.fleet.fleet import Domain, Fleet, OnConflict, SharedSpace, Vehicle
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Area, Route
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.translate import Options, translate

ORIGIN = (38.0, -77.0, 60.0)
FRAME = LocalFrame(ORIGIN)
ELSEWHERE: tuple[EastNorth, ...] = ((0.0, 80.0), (50.0, 0.0), (50.0, 40.0))
"""Outside, on the bridge, in the yard."""


def place(east: float, north: float) -> tuple[float, float, None]:
    return (*FRAME.to_latlon((east, north)), None)


def at(east: float, north: float) -> str:
    """A target, in the notation."""
    latitude, longitude, _ = place(east, north)
    return f"[{latitude},{longitude}]"


def area(west: float, south: float, east: float, north: float) -> Area:
    ring = [place(west, south), place(east, south), place(east, north), place(west, north)]
    return Area(((*ring, ring[0]),))


def route(*places: EastNorth) -> Route:
    return Route(tuple(place(*each) for each in places))


GEOMETRIES = {
    "bridge": area(40, -5, 60, 5),
    "yard": area(40, 30, 60, 50),
    "field": area(-40, -10, -20, 10),
    "over": route((20, 0), (80, 0)),
    "back": route((80, 2), (20, 2)),
    "round": route((20, 0), (80, 0), (80, 40), (20, 40)),
    "aside": route((0, -40), (90, -40)),
    "into": route((20, 40), (50, 40)),
}
WAYS = (
    "single_vehicle_routing {who} route=over",
    "single_vehicle_routing {who} route=over",
    "single_vehicle_routing {who} route=back",
    "single_vehicle_routing {who} route=round",
    "single_vehicle_routing {who} route=aside",
    "single_vehicle_routing {who} route=into",
    f"goto {{who}} target={at(50, 0)}",
    f"goto {{who}} target={at(100, 0)}",
    f"goto {{who}} target={at(0, -30)}",
    "area_survey {who} area=field",
    "area_survey {who} area=yard",
    "return_to_launch {who}",
    "drive_stop {who}",
    "follow {who} target=ugv1",
)
NAMED = ("ugv1", "ugv2", "ugv3")
BY_NEED = (
    "need:requires=vehicle.domain=='ground'",
    "need:requires=vehicle.domain=='ground';wait=unlimited",
    "need:requires=vehicle.domain=='ground';wait=PT3S",
    "need:vehicle=ugv1;wait=unlimited",
)
HOMES = {"ugv1": (0.0, 0.0), "ugv2": (100.0, 2.0), "ugv3": (50.0, 45.0)}


def random_fleet(dice: Random) -> Fleet:
    """Three rovers of which some have a home, and two shared spaces."""
    vehicles = {}
    for name, home in HOMES.items():
        known = {} if dice.random() < 0.2 else {"home": list(place(*home)[:2])}
        vehicles[ResourceId(name)] = Vehicle(ResourceId(name), Domain.GROUND, "sim", known)
    spaces = {
        name: SharedSpace(
            name,
            dice.randint(1, 2) if name == "yard" else 1,
            on_conflict=dice.choice((OnConflict.WAIT, OnConflict.REFUSE)),
            wait_s=30.0,
        )
        for name in ("bridge", "yard")
    }
    return Fleet(
        "rovers", "rovers.yaml", vehicles, origin=ORIGIN, geometries=GEOMETRIES, shared_space=spaces
    )


def random_mission(dice: Random) -> str:
    """Two or three parallel branches of tasks."""
    lines = ['<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>']
    lines += ['<endEvent id="e"/>', "s -> f", "j -> e"]
    by_need = dice.random() < 0.4
    for branch in range(dice.randint(2, 3)):
        before = "f"
        for number in range(dice.randint(1, 2)):
            name = f"t{branch}{number}"
            who = dice.choice(BY_NEED) if by_need and dice.random() < 0.5 else NAMED[branch]
            lines += _task(dice, name, who)
            lines.append(f"{before} -> {name} -> {name}x")
            before = f"{name}x"
        lines.append(f"{before} -> j")
    return "\n".join(lines)


def _task(dice: Random, name: str, who: str) -> list[str]:
    way = dice.choice(WAYS).format(who=who)
    each = '<each isSequential="true">2</each>' if dice.random() < 0.1 else ""
    lines = [
        f'<exclusiveGateway id="{name}x"/>',
        f'<scriptTask id="{name}">do {way}{each}</scriptTask>',
    ]
    caught = dice.choice(
        ("", "error", "error REJECTED", "error RESOURCE_UNAVAILABLE", "timer PT2S", "signal stop")
    )
    if caught:
        lines.append(f'<boundaryEvent id="{name}c" attachedToRef="{name}">{caught}</boundaryEvent>')
        lines.append(f"{name}c -> {name}x")
    return lines


def net_of(mission: Mission, fleet: Fleet) -> PetriNet:
    return translate(mission, fleet, options=options_of(fleet))


def options_of(fleet: Fleet) -> Options:
    return Options(open_world=True, ways=FleetWays(fleet))
