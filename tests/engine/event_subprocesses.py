"""Event subprocesses, and subprocesses around them, in the notation of tests."""

NOT = 'isInterrupting="false"'


def handler(trigger: str, attributes: str = "", inside: str = "", name: str = "h") -> str:
    """An event subprocess `h`: start `hs`, then what `inside` says, else the user task `hu`."""
    inside = inside or f'<userTask id="{name}u"/>\n{name}s -> {name}u\n'
    return (
        f'<subProcess id="{name}" triggeredByEvent="true">'
        f'<startEvent id="{name}s" {attributes}>{trigger}</startEvent>{inside}</subProcess>'
    )


def around(inside: str, *, after: str = '<task id="done"/>\nstart -> sub -> done') -> str:
    """A subprocess `sub` with that inside, between `start` and `done`."""
    return f'<startEvent id="start"/> <subProcess id="sub"> {inside} </subProcess>\n{after}\n'


WORK = """<startEvent id="s"/> <userTask id="a"/> <userTask id="b"/>
    s -> a -> b
"""
