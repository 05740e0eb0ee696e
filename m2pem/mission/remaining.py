"""Names of the data that say what is left of a task that ended early (docs/missions.md).

`FlyRoute.remaining` is the rest of the route or area of the task FlyRoute, and
`FlyRoute.remaining.speed` another parameter of it.
"""

from m2pem.mission.behavior import Behavior
from m2pem.mission.expression import Expression

GEOMETRIES = ("route", "area")
"""Parameters of which a part may be left."""


def split_name(name: str) -> tuple[str, str] | None:
    """Return the task and the parameter of a name, "" for the geometry; None: it is another."""
    task, _, rest = name.partition(".")
    remaining, _, parameter = rest.partition(".")
    return (task, parameter) if remaining == "remaining" else None


def continued(behavior: Behavior) -> set[str]:
    """Return the tasks of which a behavior does what is left."""
    given = (each.value for each in behavior.parameters)
    names = (name for each in given if isinstance(each, Expression) for name in each.names)
    return {found[0] for found in map(split_name, names) if found is not None}
