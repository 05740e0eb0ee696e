"""Random missions in which tasks wait for several vehicles, beside others that need one of them."""

from collections.abc import Iterator
from random import Random

from tests.verify.random_needs import AIR, RED

BLUE = "'blue'in[vehicle.tags[0]]"
WAITS = ("wait=unlimited", "wait=unlimited", "wait=PT3S")
HOLDS = ("need:vehicle=uav1;wait=unlimited", f"need:requires={AIR}", "uav2", "uav3")


def _roles(dice: Random) -> str:
    """The roles of a task: one vehicle, two of some, or one of each of two kinds."""
    waits = dice.choice(WAITS)
    more = dice.choice(("", "", "", ";priority=1", ";keep=subprocess", ";keep=process"))
    which = dice.choice((AIR, AIR, RED, BLUE))
    return dice.choice(
        (
            f"need:requires={which};{waits}{more}",
            f"need:requires={which}{more}",
            f"need:vehicle=uav{dice.randint(1, 3)};{waits}{more}",
            f"need:count=2;requires={dice.choice((AIR, AIR, RED))};{waits}{more}",
            f"need:count=2;requires={AIR};{waits}{more}",
            f"need:count=2..3;requires={AIR};{waits}{more}",
            f"need:requires={which};{waits}{more} need:requires={dice.choice((BLUE, RED))}",
            f"need:vehicle=uav1;{waits}{more} need:vehicle=uav3;{waits}",
        )
    )


def several(dice: Random) -> str:
    """Parallel branches; one of them holds a vehicle until another one is done."""
    lines = ['<startEvent id="s"/><parallelGateway id="f"/><endEvent id="e"/>', "s -> f"]
    count = dice.randint(2, 4)
    if dice.random() < 0.8:
        lines.append(f'<scriptTask id="H">do follow {dice.choice(HOLDS)} target=x</scriptTask>')
        lines.append('<boundaryEvent id="h" attachedToRef="H">signal go</boundaryEvent>')
        lines += ["f -> H -> e", "h -> e"]
    throws = dice.randrange(count)
    for branch in range(count):
        before = "f"
        for name, line in _steps(dice, branch):
            lines += [line, f"{before} -> {name}"]
            before = name
        if branch == throws:
            lines.append('<intermediateThrowEvent id="t">signal go</intermediateThrowEvent>')
            lines.append(f"{before} -> t")
            before = "t"
        lines.append(f"{before} -> e")
    return "\n".join(lines)


def _steps(dice: Random, branch: int) -> Iterator[tuple[str, str]]:
    """A prompt or none, and one or two tasks, or a subprocess of them."""
    if dice.random() < 0.5:
        yield f"p{branch}", f'<userTask id="p{branch}">ask on</userTask>'
    tasks = [
        (
            f"t{branch}{n}",
            f'<scriptTask id="t{branch}{n}">do drive_stop {_roles(dice)}</scriptTask>',
        )
        for n in range(dice.randint(1, 2))
    ]
    if dice.random() < 0.3:
        inside = "\n".join(line for _, line in tasks)
        flows = f"t{branch}0 -> t{branch}1" if len(tasks) > 1 else ""
        yield f"sub{branch}", f'<subProcess id="sub{branch}">\n{inside}\n{flows}\n</subProcess>'
        return
    for name, line in tasks:
        caught = dice.choice(("", "", "error RESOURCE_UNAVAILABLE", "timer PT2S"))
        event = f'<boundaryEvent id="{name}c" attachedToRef="{name}">{caught}</boundaryEvent>'
        yield name, f"{line}\n{event}\n{name}c -> e" if caught else line
