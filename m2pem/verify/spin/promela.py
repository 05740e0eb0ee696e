"""A net as PROMELA, the language of the model checker Spin.

One process loops: of the transitions of the first kind that has any enabled, one fires. Each is one
line, with a comment that says what it is in the mission. A place where one token is meant is a bit;
one that was given more room, and a variable, is a number. The states of the model are those of the
net, one for one.

`text_of` gives the text and what its lines stand for. What it asserts is chosen (`Asks`), because
Spin ends a search at what it finds first.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Flag, Kind, Rule, System
from m2pem.verify.spin.never_claim import Watch

_MARKS = {"!": "_active", ">": "_waiting", "~": "_", "/": "_"}
_LONGEST = 60


def identifiers(prefix: str, names: Iterable[str]) -> list[str]:
    """An identifier for each name, all different.

    The prefix keeps them apart from words of PROMELA and of C, which Spin writes them into.
    """
    found: list[str] = []
    used: set[str] = set()
    for name in names:
        plain = "".join(_MARKS.get(each, each) for each in name)
        plain = prefix + re.sub(r"[^A-Za-z0-9_]", "_", plain)[:_LONGEST]
        unique, number = plain, 1
        while unique in used:
            number += 1
            unique = f"{plain}_{number}"
        used.add(unique)
        found.append(unique)
    return found


def comment(text: str) -> str:
    """A text as a comment of one line; what would end the comment, or mean more in C, is spaced."""
    line = " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("\\", "\\ ")
    return f"/* {line} */"


_WARNINGS = (Flag.UNCAUGHT_FAILURE,)
_SHARED_CLEARS = 4
"""Places that are cleared together by several rules get a name together from so many on."""
_HEADINGS = {
    Kind.INTERNAL: "what the executive does by itself",
    Kind.JOIN: "joins that wait until nothing else can move",
    Kind.OUTSIDE: "what comes from outside",
}


@dataclass(frozen=True, slots=True)
class Asks:
    """What is asserted: that places are not `full` when a token comes, that `rules` never fire,
    that no run gets `stuck`, that nothing is `left` on places where a run stops, unless it failed.
    """

    full: frozenset[int] = frozenset()
    rules: frozenset[int] = frozenset()
    stuck: bool = False
    left: frozenset[int] = frozenset()

    @classmethod
    def all_of(cls, system: System) -> "Asks":
        """What a reader of the model would ask: everything but what is only a warning."""
        return cls(
            frozenset(place.index for place in system.places if not place.several),
            frozenset(r.index for r in system.rules if r.flag and r.flag not in _WARNINGS),
            True,
        )


@dataclass(slots=True)
class Model:
    """`rule_at`: the rules by line, from 1 on. `stuck_line`: where a run is that is stuck.

    `size_bytes`: an upper bound of what a state takes.
    """

    text: str
    rule_at: Mapping[int, int]
    stuck_line: int
    size_bytes: int


@dataclass(slots=True)
class _Lines:
    lines: list[str] = field(default_factory=list)

    def add(self, *lines: str) -> None:
        for line in lines:
            assert "\n" not in line
            self.lines.append(line)

    @property
    def last(self) -> int:
        return len(self.lines)


class Writer:
    """Writes one system; `encoding` says how many tokens each place has room for."""

    def __init__(self, system: System, encoding: Encoding, asks: Asks, watch: Watch | None) -> None:
        self.system = system
        self.asks = asks
        self.watch = watch
        self.most = [(1 << width) - 1 for width in encoding.width]
        self.places = identifiers("at_", [place.name for place in system.places])
        self.variables = identifiers("data_", [each.name for each in system.variables])
        self._clears: dict[tuple[int, ...], str] = {}
        self._out = _Lines()

    def write(self) -> Model:
        """The whole text."""
        out, system = self._out, self.system
        name = system.elements.get(system.process) or system.process
        out.add(
            comment(
                f"{system.mission}, {name}: {len(system.places)} places, "
                f"{len(system.variables)} variables, {len(system.rules)} rules"
            ),
            comment("at_X: tokens on X; data_X: which of its values X has"),
            "",
        )
        self._declare()
        if self.watch is not None:
            out.add(*self.watch.declarations(self.places, self.variables))
        self._shared_clears()
        out.add("active proctype mission()", "{", "end:", "  do")
        out.add("  :: atomic {")
        rule_at, stuck_line = self._rules()
        out.add("  } od", "}")
        if self.watch is not None:
            out.add("", self.watch.claim())
        return Model("\n".join(out.lines) + "\n", rule_at, stuck_line, self._size_bytes())

    def _size_bytes(self) -> int:
        watched = self.watch.size_bytes if self.watch is not None else 0
        bits = sum(1 for each in self.most if each == 1)
        return bits // 8 + 4 * (len(self.most) - bits + len(self.variables)) + watched + 200

    # --- what there is --------------------------------------------------------------------------

    def _declare(self) -> None:
        begin = dict(self.system.initial)
        for place, name, most in zip(self.system.places, self.places, self.most, strict=True):
            kind = "bit" if most == 1 else _number(most)
            said = f"{place.element}, {place.role.value}"
            if place.resources:
                said += f": {place.behavior} holds {', '.join(place.resources)}"
            first = f" = {begin[place.index]}" if place.index in begin else ""
            self._out.add(f"{kind} {name}{first}; {comment(said)}")
        for variable, name in zip(self.system.variables, self.variables, strict=True):
            values = ", ".join(
                f"{n}: {value!r}" if exact else f"{n}: such as {value!r}"
                for n, (value, exact) in enumerate(
                    zip(variable.values, variable.exact, strict=True)
                )
            )
            kind = _number(len(variable.values))
            said = comment(f"{variable.name} is {values}")
            self._out.add(f"{kind} {name} = {variable.initial}; {said}")
        self._out.add("")

    def _shared_clears(self) -> None:
        users: dict[tuple[int, ...], list[Rule]] = {}
        for rule in self.system.rules:
            if len(rule.kill) >= _SHARED_CLEARS:
                users.setdefault(rule.kill, []).append(rule)
        for number, (places, rules) in enumerate(users.items()):
            if len(rules) > 1:
                name = self._clears[places] = f"clear_{number + 1}"
                body = " ".join(f"{self.places[p]} = 0;" for p in places)
                said = comment(f"by {', '.join(dict.fromkeys(r.element for r in rules))}")
                self._out.add(f"inline {name}() {{ {body} }} {said}")
        if self._clears:
            self._out.add("")

    # --- rules ----------------------------------------------------------------------------------

    def _rules(self) -> tuple[dict[int, int], int]:
        out = self._out
        rule_at: dict[int, int] = {}
        depth = 0
        if self.watch is not None and self.watch.needs_quiet:
            out.add("    if", f"    {self.watch.quiet_line()}", "    :: else ->")
            depth += 1
        for kind in Kind:
            rules = [rule for rule in self.system.rules if rule.kind is kind]
            if not rules:
                continue
            out.add("    if", f"    {comment(_HEADINGS[kind])}")
            for rule in rules:
                out.add(f"    {self.line_of(rule)}")
                rule_at[out.last] = rule.index
            out.add("    :: else ->")
            depth += 1
        ends = " || ".join(self.places[p] for p in sorted(self.system.ends))
        left = " || ".join(self.places[p] for p in sorted(self.asks.left))
        over = f"assert({self.places[self.system.failed]} || !({left}))" if left else "skip"
        out.add("    if", f"    :: {ends} -> {over} {comment('the run is over')}")
        stuck = "assert(false)" if self.asks.stuck else over
        out.add(f"    :: else -> {stuck} {comment('the run is stuck')}")
        stuck_line = out.last
        out.add("    fi " + "fi " * depth)
        return rule_at, stuck_line

    def line_of(self, rule: Rule) -> str:
        """One rule."""
        said = "; ".join(
            f"{step.element} {step.action.value}" + (f" {step.detail}" if step.detail else "")
            for step in rule.steps
        )
        if rule.trigger is not None:
            said = f"{rule.trigger.value} {rule.detail}".strip() + f": {said}"
        if rule.flag is not None:
            said += f" ({rule.flag.value}: {rule.flagged})"
        guard = " && ".join(self._tests(rule)) or "true"
        effects = "; ".join(self._effects(rule))
        return f":: {guard} -> d_step {{ {effects} }} {comment(f'{rule.index} {said}')}"

    def _tests(self, rule: Rule) -> list[str]:
        places = self.places
        consumed = {p for p, _ in rule.consume}
        tests = [
            "false" if n > self.most[p] else places[p] if n == 1 else f"{places[p]} >= {n}"
            for p, n in rule.consume
        ]
        tests += [places[p] for p in rule.read if p not in consumed]
        tests += [f"!{places[p]}" for p in rule.inhibit]
        for variable, allowed in rule.guard:
            count = len(self.system.variables[variable].values)
            if len(allowed) < count:
                tests.append(one_of(self.variables[variable], sorted(allowed), count))
        return tests

    def _effects(self, rule: Rule) -> list[str]:
        """In the order that `m2pem.verify.net.petri_net` tells."""
        places, most = self.places, self.most
        effects: list[str] = []
        if rule.index in self.asks.rules:
            effects.append("assert(false)")
        for p, n in rule.consume:
            effects.append(
                f"{places[p]} = 0" if most[p] == 1 else f"{places[p]} = {places[p]} - {n}"
            )
        for pairs, gone in ((rule.moves, True), (rule.copies, False)):
            for source, target in pairs:
                then = f"{places[source]} = 0; " if gone else ""
                then += self._one_more(target)
                effects.append(f"if :: {places[source]} -> {then} :: else fi")
        if rule.kill in self._clears:
            effects.append(f"{self._clears[rule.kill]}()")
        else:
            effects += [f"{places[p]} = 0" for p in rule.kill]
        refilled = {target for _, target in (*rule.moves, *rule.copies)}
        emptied = {p for p, _ in rule.consume if most[p] == 1} - refilled | set(rule.kill)
        for p, n in rule.produce:
            if p in self.asks.full and not (p in emptied and n <= most[p]):
                effects.append(f"assert({places[p]} <= {most[p] - n})")
            effects.append(self._more(p, n))
        effects += [f"{self.variables[v]} = {value}" for v, value in rule.assign]
        if self.watch is not None:
            effects += self.watch.after_rule(rule.index)
        return effects or ["skip"]

    def _one_more(self, p: int) -> str:
        return self._more(p, 1)

    def _more(self, p: int, n: int) -> str:
        """So many tokens more, up to those that there is room for."""
        name, most = self.places[p], self.most[p]
        if most <= n:
            return f"{name} = {most}"
        return f"if :: {name} <= {most - n} -> {name} = {name} + {n} :: else -> {name} = {most} fi"


def text_of(
    system: System,
    encoding: Encoding | None = None,
    asks: Asks | None = None,
    watch: Watch | None = None,
) -> Model:
    """The model, by default with everything asserted that is a violation."""
    encoding = encoding or Encoding(system)
    return Writer(system, encoding, asks or Asks.all_of(system), watch).write()


def one_of(variable: str, allowed: Sequence[int], count: int) -> str:
    """That a variable has one of some of its `count` values."""
    if not allowed:
        return "false"
    missing = sorted(set(range(count)) - set(allowed))
    if len(missing) < len(allowed):
        return "(" + " && ".join(f"{variable} != {n}" for n in missing) + ")"
    return "(" + " || ".join(f"{variable} == {n}" for n in allowed) + ")"


def _number(most: int) -> str:
    return "byte" if most <= 255 else "short" if most <= 32_767 else "int"
