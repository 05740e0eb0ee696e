"""Spin's own automata for formulas (`spin -f`), and whether they accept a run."""

import re
import shutil
import subprocess
from collections.abc import Sequence

from m2pem.verify.ltl.formula import (
    Always,
    And,
    Constant,
    Eventually,
    Formula,
    Iff,
    Implies,
    Not,
    Or,
    Until,
    WeakUntil,
)
from m2pem.verify.ltl.lasso import Moment
from tests.verify.formulas import ATOMS

SPIN = shutil.which("spin")
ALL = "accept_all"
Claim = dict[str, list[tuple[str, str]]]
"""By state, what a letter must fulfil (as Python) for which next state."""


def promela(formula: Formula) -> str:
    match formula:
        case Constant():
            return "true" if formula.value else "false"
        case Not():
            return f"!({promela(formula.operand)})"
        case And():
            return "(" + " && ".join(map(promela, formula.operands)) + ")"
        case Or():
            return "(" + " || ".join(map(promela, formula.operands)) + ")"
        case Implies(left, right):
            return f"({promela(left)} -> {promela(right)})"
        case Iff(left, right):
            return f"({promela(left)} <-> {promela(right)})"
        case Always():
            return f"[]({promela(formula.operand)})"
        case Eventually():
            return f"<>({promela(formula.operand)})"
        case Until(left, right):
            return f"({promela(left)} U {promela(right)})"
        case WeakUntil(left, right):
            return f"(({promela(left)} U {promela(right)}) || []({promela(left)}))"
        case _:
            return f"p{ATOMS.index(formula)}"  # type: ignore[arg-type]


def never_claim(formula: Formula) -> Claim:
    assert SPIN is not None
    done = subprocess.run(
        [SPIN, "-f", promela(formula)], capture_output=True, text=True, timeout=60, check=True
    )
    claim: Claim = {ALL: [("True", ALL)]}
    same: dict[str, str] = {}
    state = ""
    for line in done.stdout.splitlines():
        if found := re.match(r"(\w+):", line):
            if state and not claim[state]:  # two labels of one state
                same[found[1]] = state
                continue
            state = found[1]
            claim.setdefault(state, [])
        elif found := re.match(r"\s*:: atomic \{ (.*) -> assert", line):
            claim[state].append((_python(found[1]), ALL))
        elif found := re.match(r"\s*:: (.*) -> goto (\w+)", line):
            claim[state].append((_python(found[1]), found[2]))
        elif re.match(r"\s*(:: )?false", line):
            claim[state].append(("False", state))
        else:
            assert re.match(r"never|\s*(if|fi;|do|od;|skip|})", line), line
    return {
        name: [(what, same.get(target, target)) for what, target in each]
        for name, each in claim.items()
    }


def _python(condition: str) -> str:
    text = condition.replace("&&", " and ").replace("||", " or ").replace("!", " not ")
    return text.replace("true", "True").replace("false", "False")


def accepts(claim: Claim, prefix: Sequence[Moment], cycle: Sequence[Moment]) -> bool:
    moments = [*prefix, *cycle]
    edges: dict[tuple[int, str], list[tuple[int, str]]] = {}
    first = next(state for state in claim if state != ALL) if len(claim) > 1 else ALL
    waiting = [(0, first)]
    while waiting:
        node = waiting.pop()
        if node in edges:
            continue
        at, state = node
        values = {f"p{n}": each in moments[at] for n, each in enumerate(ATOMS)}
        then = at + 1 if at + 1 < len(moments) else len(prefix)
        edges[node] = [(then, target) for what, target in claim[state] if eval(what, values)]
        waiting += edges[node]
    return any(node[1].startswith("accept") and _comes_back(node, edges) for node in edges)


def _comes_back(node: tuple[int, str], edges: dict[tuple[int, str], list[tuple[int, str]]]) -> bool:
    seen: set[tuple[int, str]] = set()
    waiting = list(edges[node])
    while waiting:
        each = waiting.pop()
        if each == node:
            return True
        if each not in seen:
            seen.add(each)
            waiting += edges[each]
    return False
