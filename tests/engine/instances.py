"""Multi-instance activities, begun with data."""

from m2pem.mission.values import Value
from tests.engine.kit import Play


def scripted(each: str, script: str, **data: Value) -> Play:
    """A script task with instances, started with data."""
    body = script.replace(";", "\n")
    return Play(f"""
        <dataObject id="items"/> <dataObject id="results"/>
        <startEvent id="s"/> <endEvent id="e"/>
        <scriptTask id="t">{each}<script>{body}</script></scriptTask>
        s -> t -> e
    """).start(data)


def asked(each: str, more: str = "", **data: Value) -> Play:
    """A user task with instances."""
    return Play(f"""
        <dataObject id="items"/> <dataObject id="results"/>
        <startEvent id="s"/> <endEvent id="e"/> <userTask id="u">ask done no{each}</userTask> {more}
        s -> u -> e
    """).start(data)
