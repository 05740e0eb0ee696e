"""Random missions whose roles keep vehicles between tasks, in the tests' notation.

Tasks that are executed again, by the same token and by others; subprocesses that begin again, and
that event subprocesses interrupt; called processes, and processes that messages begin.
"""

from collections.abc import Callable, Sequence
from random import Random

from tests.verify.random_needs import AIR, NEEDS, RED, branches_with_needs

KEEPS = ("keep=process", "keep=subprocess", "keep=task")

KEEPING = (
    *(f"{NEEDS[n]};{keep}" for n in (0, 1, 2, 3, 4, 5, 8, 9, 11) for keep in KEEPS),
    f"{NEEDS[6]};keep=task",
    *(NEEDS[n] for n in (0, 1, 6, 10, 12, 13, 14)),
)
"""Roles that keep what fills them, and some that do not."""

ALIKE = tuple(
    f"need:requires={which}{wait}{keep}"
    for which in (AIR, RED)
    for wait in ("", ";wait=unlimited", ";wait=PT3S")
    for keep in ("", *(f";{keep}" for keep in KEEPS))
)
"""The same, of vehicles that nothing distinguishes."""

PAIRS = tuple(
    f"need:requires={AIR}{one} need:requires={AIR}{other}"
    for one, other in (
        (";keep=process", ""),
        ("", ";keep=process"),
        (";keep=process", ";keep=process"),
        (";keep=process", ";keep=task"),
        (";keep=subprocess", ";keep=process"),
    )
)
"""Tasks of two roles: what one of them has kept may fill the other when it is executed again."""

LOST = tuple(
    f"need:requires={AIR};wait=unlimited{keep};onLoss=reassign"
    for keep in ("", ";keep=process", ";keep=subprocess")
)


def keeping(dice: Random) -> str:
    """A mission of one of these kinds."""
    needs = dice.choice((KEEPING, KEEPING, ALIKE, (*ALIKE, *LOST), (*PAIRS, *KEEPING[:6])))
    kinds: Sequence[Callable[[Random, Sequence[str]], str]] = (
        lambda dice, needs: branches_with_needs(dice, tuple(needs)),
        again,
        _subprocesses_again,
        _interrupted,
        _called,
        _begun_by_messages,
    )
    return dice.choice(kinds)(dice, needs)


def _task(dice: Random, name: str, needs: Sequence[str], more: str = "") -> str:
    return f'<scriptTask id="{name}">do drive_stop {dice.choice(needs)}{more}</scriptTask>'


def _fork(branches: Sequence[tuple[list[str], str, str]]) -> str:
    """Parallel branches, each by its lines, its first element and its last."""
    lines = ['<startEvent id="s"/><parallelGateway id="f"/><parallelGateway id="j"/>']
    lines += ['<endEvent id="e"/>', "s -> f", "j -> e"]
    for own, first, last in branches:
        lines += [*own, f"f -> {first}", f"{last} -> j"]
    return "\n".join(lines)


def _caught(name: str, task: str) -> str:
    return f'<boundaryEvent id="{name}" attachedToRef="{task}">error ROUTE_BLOCKED</boundaryEvent>'


def _branch_again(dice: Random, name: str, needs: Sequence[str]) -> tuple[list[str], str, str]:
    """One or two tasks; when one fails, they are executed again."""
    first, last = f"{name}m", f"{name}x"
    lines = [f'<exclusiveGateway id="{first}"/><exclusiveGateway id="{last}"/>']
    tasks = [f"{name}{letter}" for letter in "ab"[: dice.randint(1, 2)]]
    lines += [_task(dice, task, needs) for task in tasks]
    lines.append(" -> ".join((first, *tasks, last)))
    failing = dice.choice(tasks)
    lines.append(_caught(f"{name}c", failing))
    lines.append(f"{name}c -> {first}")
    return lines, first, last


def again(dice: Random, needs: Sequence[str]) -> str:
    return _fork([_branch_again(dice, name, needs) for name in "pqr"[: dice.randint(1, 3)]])


def _subprocess(
    dice: Random, name: str, needs: Sequence[str], handler: str = "", more: str = ""
) -> str:
    tasks = [f"{name}1", f"{name}2"]
    lines = [f'<startEvent id="{name}s"/>', *(_task(dice, each, needs) for each in tasks)]
    if dice.random() < 0.5:
        lines.append(f"{name}s -> {tasks[0]} -> {tasks[1]}")
    else:
        lines += [f"{name}s -> {task}" for task in tasks]
    body = "\n".join(lines)
    return f'<subProcess id="{name}">{more}\n{body}\n{handler}</subProcess>'


def _subprocesses_again(dice: Random, needs: Sequence[str]) -> str:
    """Subprocesses that begin again when something in them fails, and some of many instances."""
    branches = []
    for name in "pq":
        first, last = f"{name}m", f"{name}x"
        more = dice.choice(("", "<each>2</each>", '<each isSequential="true">2</each>'))
        lines = [
            f'<exclusiveGateway id="{first}"/><exclusiveGateway id="{last}"/>',
            _subprocess(dice, name, needs, more=more),
            _caught(f"{name}c", name),
            f"{first} -> {name} -> {last}",
            f"{name}c -> {first}",
        ]
        branches.append((lines, first, last))
    return _fork(branches)


def _interrupted(dice: Random, needs: Sequence[str]) -> str:
    """A subprocess with an event subprocess, beside a task that is perhaps executed again."""
    kind = dice.choice(("signal stop", "error"))
    goes_on = ' isInterrupting="false"' if kind != "error" and dice.random() < 0.4 else ""
    handler = (
        f'<subProcess id="h" triggeredByEvent="true"><startEvent id="hs"{goes_on}>{kind}'
        f"</startEvent>{_task(dice, 'h1', needs)}\nhs -> h1\n</subProcess>"
    )
    lines = [
        _subprocess(dice, "p", needs, handler),
        '<boundaryEvent id="pc" attachedToRef="p">error</boundaryEvent>',
        '<exclusiveGateway id="px"/>',
        "p -> px",
        "pc -> px",
    ]
    return _fork([(lines, "p", "px"), _branch_again(dice, "q", needs)])


def _called(dice: Random, needs: Sequence[str]) -> str:
    """Processes that are called, at the same time and one after the other."""
    calls = ["k1", "k2"]
    lines = [f'<callActivity id="{call}" calledElement="SUB"/>' for call in calls]
    between = _task(dice, "t", needs)
    branches = [([lines[0]], "k1", "k1"), ([lines[1], between, "k2 -> t"], "k2", "t")]
    inside = "\n".join(
        ['<startEvent id="cs"/>', _task(dice, "c1", needs), _task(dice, "c2", needs)]
    )
    return (
        f'<process id="MAIN" isExecutable="true">\n{_fork(branches)}\n</process>\n'
        f'<process id="SUB">\n{inside}\ncs -> c1 -> c2\n</process>'
    )


def _begun_by_messages(dice: Random, needs: Sequence[str]) -> str:
    """A process that messages begin, beside the one that the run begins with."""
    other = "\n".join(
        [
            '<startEvent id="os">message m1</startEvent>',
            _task(dice, "o1", needs),
            _task(dice, "o2", needs),
            "os -> o1 -> o2",
        ]
    )
    main = _fork([_branch_again(dice, "p", needs)])
    return (
        f'<process id="MAIN" isExecutable="true">\n{main}\n</process>\n'
        f'<process id="OTHER">\n{other}\n</process>'
    )
