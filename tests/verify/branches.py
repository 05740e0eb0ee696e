"""Random missions of parallel branches: tasks in a row, and loops that an operator ends."""

from hypothesis import strategies as st

from m2pem.mission.mission import Mission
from tests.bpmn.bpmn_text import flow
from tests.verify.missions import mission, task


def _loop(number: int, before: str, after: str) -> str:
    """Ask again and again; each time but the last, something is done."""
    ask, which, done, merge = (f"{letter}{number}" for letter in "AWDM")
    prompt = (
        f'<m2pem:userTask store="u{number}"><m2pem:decision value="go"/>'
        '<m2pem:decision value="stop"/></m2pem:userTask>'
    )
    ways = "".join(
        f'<sequenceFlow id="{which}-{target}" sourceRef="{which}" targetRef="{target}">'
        f"<conditionExpression>u{number} == '{decision}'</conditionExpression></sequenceFlow>"
        for target, decision in ((done, "go"), (after, "stop"))
    )
    return (
        f'<exclusiveGateway id="{which}"/><exclusiveGateway id="{merge}"/><task id="{done}"/>'
        f'<userTask id="{ask}"><extensionElements>{prompt}</extensionElements></userTask>'
        f"{flow(before, merge)}{flow(merge, ask)}{flow(ask, which)}{flow(done, merge)}{ways}"
    )


def branches(shapes: list[tuple[int, bool]], *, interruptible: bool = False) -> Mission:
    """A mission with a branch for each shape: so many tasks, and then a loop or none.

    `interruptible`: in a subprocess that a timer interrupts, after which it is begun once more, or
    a task follows.
    """
    body = [
        '<startEvent id="S"/><parallelGateway id="Fork"/><parallelGateway id="Join"/>',
        '<endEvent id="E"/>',
        flow("S", "Fork"),
        flow("Join", "E"),
    ]
    for number, (tasks, loops) in enumerate(shapes):
        last = "Fork"
        for place in range(tasks):
            name = f"T{number}x{place}"
            body += [task(name, f"v{number}", "goto", target="x"), flow(last, name)]
            last = name
        body.append(_loop(number, last, "Join") if loops else flow(last, "Join"))
    if interruptible:
        body = [
            f'<subProcess id="Sub">{"".join(body)}</subProcess><startEvent id="S0"/>',
            '<exclusiveGateway id="M"/><exclusiveGateway id="W"/><task id="After"/>',
            '<endEvent id="E0"/><boundaryEvent id="B" attachedToRef="Sub"><timerEventDefinition>'
            "<timeDuration>PT5M</timeDuration></timerEventDefinition></boundaryEvent>",
            *(flow("S0", "M"), flow("M", "Sub"), flow("Sub", "E0"), flow("B", "W")),
            *(flow("W", "M"), flow("W", "After"), flow("After", "E0")),
        ]
    return mission(*body)


shapes = st.lists(
    st.tuples(st.integers(1, 2), st.sampled_from([False, False, True])), min_size=2, max_size=3
)
