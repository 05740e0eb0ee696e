"""Behaviors, service calls and roles: what m2pem's extension elements must say."""

from m2pem.bpmn.rules.rule import error, warning

BEHAVIOR_NAME = error(
    204,
    "a behavior has no name",
    'write for example <property name="name" value="goto"/>',
)
BEHAVIOR_TYPE = error(
    205,
    "a behavior's type is none that there is",
    "write vehicle, payload or team",
)
PARAMETER_NAME = error(
    206,
    "a parameter has no name, or the name of another",
    'write <property name="speed" value="2 m/s"/>',
)
ROLE_NAME = error(
    207,
    "a role has no name, or the name of another",
    "give each its own name",
)
ROLE_ALLOCATION = error(
    208,
    "a role is given to nothing, or to several",
    "name one vehicle, payload or team",
)
ROLE_NOT_LITERAL = error(
    209,
    "a role is an expression",
    "write the vehicle, payload or team itself",
)
ROLE_NEED = error(
    210,
    "what a role needs makes no sense",
    "the message names the attribute and what it may be",
)
TWO_BEHAVIORS = error(
    211,
    "a task has several behaviors, or also a service or message",
    "keep one",
)
TWO_SERVICES = error(
    212,
    "a service task names several classes",
    "keep one",
)
SERVICE_CLASS = error(
    213,
    "a service has no class",
    'write for example <m2pem:service class="Detector"/>',
)
NO_SERVICE = warning(
    303,
    "a service task names no service",
    'add <m2pem:service class="Detector"/> to its extension elements, or make it a plain task',
)
MISPLACED = error(
    219,
    "a property, parameter or role is outside the element for it",
    "move it into that element",
)
DUPLICATE_PARAMETER = error(
    220,
    "a behavior has a parameter twice",
    "keep one of the two",
)
BAD_GEOMETRY = error(
    224,
    "a route, area or point of the mission has no name of its own, or is no GeoJSON",
    "the message says what is expected",
)
MENDED_GEOMETRY = warning(
    318,
    "an area of the mission has an edge that goes out and back",
    "draw it again, if it is not as you mean it",
)
DUPLICATE_PROPERTY = error(
    221,
    "a service has a property twice",
    "keep one of the two",
)
DUPLICATE_ROLE = error(
    222,
    "a behavior has a role twice",
    "keep one of the two",
)
