"""Conditional events, and branches that change what they read, in the notation of tests."""


def handler(condition: str, attributes: str = "", inside: str = "", name: str = "h") -> str:
    """An event subprocess with a conditional start: `hs`, then `inside`, else user task `hu`."""
    inside = inside or f'<userTask id="{name}u"/>\n{name}s -> {name}u\n'
    return (
        f'<subProcess id="{name}" triggeredByEvent="true"><startEvent id="{name}s" {attributes}>'
        f"conditional {condition}</startEvent>{inside}</subProcess>"
    )


WRITES = """<startEvent id="w"/> <userTask id="first"/> <scriptTask id="set">{set}</scriptTask>
    <userTask id="second"/> <scriptTask id="again">{again}</scriptTask> <userTask id="third"/>
    w -> first -> set -> second -> again -> third
"""


def writing(*texts: str) -> str:
    """A branch that writes in between three user tasks."""
    first, again = (*texts, "done = true", "done = true")[:2]
    return WRITES.format(set=first, again=again)


CATCH = """<startEvent id="start"/> <task id="after"/>
    <intermediateCatchEvent id="catch">conditional x > 3</intermediateCatchEvent>
    start -> catch -> after
"""
