"""What is left of behaviors that end early, as data that tasks and conditions read.

It is written only under names that the mission reads (`m2pem.mission.remaining`).
"""

import json

from m2pem.engine.execution import Execution
from m2pem.engine.state import Behavior, Token
from m2pem.mission.behavior import Behavior as BehaviorOfTask
from m2pem.mission.remaining import GEOMETRIES, continued, split_name
from m2pem.mission.values import Value


def note_remaining(
    x: Execution, token: Token, behavior: Behavior, *, succeeded: bool = False
) -> None:
    """Write what is left of the behavior of a token's task, and so of those that it continues."""
    task = getattr(token.node, "behavior", None)
    left = {**behavior.parameters, **(behavior.left or {})}
    geometry = next((left[name] for name in GEOMETRIES if name in left), None)
    if geometry is None or not isinstance(task, BehaviorOfTask):
        return
    tasks = {token.node.local_id, *continued(task)}
    for name in sorted(x.mission.remaining_names):
        of, parameter = split_name(name) or ("", "")
        if of in tasks:
            value = left.get(parameter) if parameter else geometry
            text = json.dumps(value) if isinstance(value, dict) else value
            x.write_in(token.scope, token.node, {name: "" if succeeded else text})


def is_nothing_left(task: BehaviorOfTask, parameters: dict[str, Value]) -> bool:
    """Whether a task is to continue one that has succeeded."""
    return any(parameters.get(each) == "" for each in GEOMETRIES) and bool(continued(task))
