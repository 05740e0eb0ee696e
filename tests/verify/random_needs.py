"""Random missions in which parallel branches need the same few vehicles, in the tests' notation."""

from random import Random

from m2pem.fleet.default_fleet import fleet_for
from m2pem.fleet.fleet import Fleet
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import PetriNet
from m2pem.verify.translate import Options, translate
from tests.verify.allocator import offers_all, with_vehicles

AIR = "vehicle.domain=='air'"
RED = "'red'in[vehicle.tags[0]]"
NEEDS = (
    f"need:requires={AIR}",
    f"need:requires={AIR};wait=unlimited",
    f"need:requires={RED};wait=PT3S",
    f"need:requires={RED};priority=1",
    "need:requires=true;wait=PT3S;priority=1",
    "need:requires=true;store=scout",
    "need:same=scout;wait=PT3S",
    "need:same=scout need:requires=true?",
    f"need:count=2;requires={AIR}",
    f"need:count=1..3;requires={AIR}",
    f"need:requires={RED} need:requires=true",
    "need:vehicle=uav1;wait=unlimited",
    "uav1",
    "uav1 uav2",
    "evsg1",
)


OPEN = Options(
    open_world=True,
    service_writes={"Look": ["detection.type"]},
    catalogue=offers_all,
)


def fleet_of(mission: Mission) -> Fleet:
    """The vehicles that a mission names, three red ones and a blue one."""
    return with_vehicles(fleet_for(mission), uav1="red", uav2="red", uav3="red", uav4="blue")


def net_of(mission: Mission) -> PetriNet:
    return translate(mission, fleet_of(mission), options=OPEN)


def branches_with_needs(dice: Random, needs: tuple[str, ...] = NEEDS) -> str:
    """Two or three parallel branches of tasks, some in a scope that is interrupted.

    `needs`: the roles of each task are one of these texts.
    """
    lines = ['<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>']
    lines += ['<endEvent id="e"/>', "j -> e"]
    if dice.random() < 0.5:  # what the branches may read with `same`
        first = _task(dice, "first", ("need:requires=true;store=scout",))
        lines += [first, "s -> first -> f"]
    else:
        lines.append("s -> f")
    for branch in range(dice.randint(2, 3)):
        before = "f"
        for number in range(dice.randint(1, 2)):
            name = f"t{branch}{number}"
            kind = dice.choice(("plain", "plain", "caught", "caught", "timed", "scope", "loop"))
            lines += _step(dice, name, kind, needs)
            lines.append(f"{before} -> {name}")
            before = f"{name}x"
        lines.append(f"{before} -> j")
    return "\n".join(lines)


def _step(dice: Random, name: str, kind: str, needs: tuple[str, ...]) -> list[str]:
    """A task, or a subprocess of two, that is entered at `name` and left at `{name}x`."""
    lines = [f'<exclusiveGateway id="{name}x"/>', f"{name} -> {name}x"]
    if kind == "scope":
        inside = [_task(dice, f"{name}a", needs), _task(dice, f"{name}b", needs)]
        flows = [f"{name}s -> {name}a", f"{name}s -> {name}b"]
        start = f'<startEvent id="{name}s"/>'
        body = "\n".join([start, *inside, *flows])
        lines.append(f'<subProcess id="{name}">\n{body}\n</subProcess>')
    else:
        each = dice.choice(("<each>2</each>", '<each isSequential="true">2</each>'))
        lines.append(_task(dice, name, needs, each if kind == "loop" else ""))
    caught = {
        "caught": "error RESOURCE_UNAVAILABLE",
        "loop": "error",
        "timed": "timer PT2S",
        "scope": dice.choice(("signal stop", "timer PT2S", "error")),
    }.get(kind)
    if caught is not None:
        lines.append(f'<boundaryEvent id="{name}c" attachedToRef="{name}">{caught}</boundaryEvent>')
        lines.append(f"{name}c -> {name}x")
    return lines


def _task(dice: Random, name: str, needs: tuple[str, ...], more: str = "") -> str:
    return f'<scriptTask id="{name}">do drive_stop {dice.choice(needs)}{more}</scriptTask>'
