"""Small missions with vehicles, as files."""

from itertools import pairwise

from m2pem.mission.mission import Mission
from tests.bpmn.bpmn_text import definitions, flow, load


def task(name: str, vehicle: str, behavior: str, **parameters: str) -> str:
    written = "".join(f'<property name="{k}" value="{v}"/>' for k, v in parameters.items())
    return (
        f'<scriptTask id="{name}" name="{name.upper()}"><script><![CDATA[<behavior type="vehicle"'
        f' name="{behavior}"><properties>{written}</properties><resources>'
        f'<role name="driver" vehicle="{vehicle}"/></resources></behavior>]]></script></scriptTask>'
    )


def survey(name: str, vehicle: str, area: str) -> str:
    return task(name, vehicle, "area_survey", area=area)


def ask(name: str, *decisions: str) -> str:
    offered = "".join(f'<m2pem:decision value="{each}"/>' for each in decisions)
    return (
        f'<userTask id="{name}"><extensionElements><m2pem:prompt>Go on?</m2pem:prompt>{offered}'
        "</extensionElements></userTask>"
    )


def choice(source: str, target: str, decision: str) -> str:
    return (
        f'<sequenceFlow id="{source}-{target}" sourceRef="{source}" targetRef="{target}">'
        f"<conditionExpression>user.decision == '{decision}'</conditionExpression></sequenceFlow>"
    )


def mission(*body: str, requirements: str = "") -> Mission:
    """A mission of one process P; `requirements` stand on line 3."""
    extended = f"<extensionElements>{requirements}</extensionElements>"
    return load(definitions(f'<process id="P">\n{extended}\n{"".join(body)}\n</process>'))


def in_a_row(*elements: str, requirements: str = "") -> Mission:
    """Start S, the elements one after the other, end E; ids are taken from the texts."""
    ids = [each.split('id="')[1].split('"')[0] for each in elements]
    row = ["S", *ids, "E"]
    flows = [flow(one, two) for one, two in pairwise(row)]
    ends = '<startEvent id="S"/><endEvent id="E"/>'
    return mission(*elements, ends, *flows, requirements=requirements)


def pair(*, again: bool = False) -> Mission:
    """uav1 surveys north and south, or north twice; uav2 east and west at the same time."""
    south = "north" if again else "south"
    return mission(
        '<startEvent id="S"/><parallelGateway id="Fork"/><parallelGateway id="Join"/>'
        '<endEvent id="E"/>',
        survey("North", "uav1", "north"),
        survey("South", "uav1", south),
        survey("East", "uav2", "east"),
        survey("West", "uav2", "west"),
        *(flow("S", "Fork"), flow("Fork", "North"), flow("North", "South"), flow("South", "Join")),
        *(flow("Fork", "East"), flow("East", "West"), flow("West", "Join"), flow("Join", "E")),
    )


def approval() -> Mission:
    """An operator is asked until the answer is stop; at each go, the rover drives."""
    return mission(
        '<startEvent id="S"/><exclusiveGateway id="Which"/><endEvent id="E"/>',
        ask("Ask", "go", "stop"),
        task("Drive", "rover", "goto", target="gate"),
        *(flow("S", "Ask"), flow("Ask", "Which"), choice("Which", "Drive", "go")),
        *(choice("Which", "E", "stop"), flow("Drive", "Ask")),
    )
