"""Behaviors, service calls and roles: what m2pem's extension elements must say."""

from m2pem.bpmn.rules.rule import E, Rule, W

BEHAVIOR_NAME = Rule(
    204,
    "behavior-name",
    "missions.md",
    E,
    "a behavior has no name",
    "name a behavior of the catalogue",
)
BEHAVIOR_TYPE = Rule(
    205,
    "behavior-type",
    "missions.md",
    E,
    "a behavior's type is none that there is",
    "write vehicle, payload or team",
)
PARAMETER_NAME = Rule(
    206,
    "parameter-name",
    "missions.md",
    E,
    "a parameter has no name, or the name of another",
    "give each its own name",
)
ROLE_NAME = Rule(
    207,
    "role-name",
    "missions.md",
    E,
    "a role has no name, or the name of another",
    "give each its own name",
)
ROLE_ALLOCATION = Rule(
    208,
    "role-allocation",
    "missions.md",
    E,
    "a role is given to nothing, or to several",
    "name one vehicle, payload or team",
)
ROLE_NOT_LITERAL = Rule(
    209,
    "role-not-literal",
    "missions.md",
    E,
    "a role is an expression",
    "name the vehicle, payload or team itself",
)
ROLE_NEED = Rule(
    210,
    "role-need",
    "missions.md",
    E,
    "what a role needs makes no sense",
    "the message names the attribute and what it may be",
)
TWO_BEHAVIORS = Rule(
    211,
    "two-behaviors",
    "missions.md",
    E,
    "a task has several behaviors, or also a service or message",
    "keep one",
)
TWO_SERVICES = Rule(
    212,
    "two-services",
    "missions.md",
    E,
    "a service task names several classes",
    "keep one",
)
SERVICE_CLASS = Rule(
    213,
    "service-class",
    "missions.md",
    E,
    "a service has no class",
    "write the class of the service",
)
NO_SERVICE = Rule(
    303,
    "no-service",
    "missions.md",
    W,
    "a service task names no service",
    "name one, or make it a plain task",
)
MISPLACED = Rule(
    219,
    "misplaced",
    "missions.md",
    E,
    "a property, parameter or role is outside the element for it",
    "move it into that element",
)
DUPLICATE_PARAMETER = Rule(
    220,
    "duplicate-parameter",
    "missions.md",
    E,
    "a behavior has a parameter twice",
    "keep one of the two",
)
BAD_GEOMETRY = Rule(
    224,
    "bad-geometry",
    "missions.md",
    E,
    "a route, area or point of the mission has no name of its own, or is no GeoJSON",
    "the message says what is expected",
)
DUPLICATE_PROPERTY = Rule(
    221,
    "duplicate-property",
    "missions.md",
    E,
    "a service has a property twice",
    "keep one of the two",
)
DUPLICATE_ROLE = Rule(
    222,
    "duplicate-role",
    "missions.md",
    E,
    "a behavior has a role twice",
    "keep one of the two",
)
