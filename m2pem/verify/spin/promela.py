"""A net as PROMELA, the language of the model checker Spin.

One process loops: of the transitions of the first kind that has any enabled, one fires. Each is one
line, with a comment that says what it is in the mission. A place where one token is meant is a bit;
one that was given more room, and a variable, is a number. The states of the model are those of the
net, one for one.

`text_of` gives the text and what its lines stand for. What it asserts is chosen (`Assertions`),
because Spin ends a search at what it finds first.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from m2pem.verify.net.encoding import Encoding
from m2pem.verify.net.petri_net import Flag, Kind, PetriNet, Transition
from m2pem.verify.spin.never_claim import NeverClaim

_MARKS = {"!": "_active", ">": "_waiting", "~": "_", "/": "_"}
_LONGEST = 60


def identifiers(prefix: str, names: Iterable[str]) -> list[str]:
    """A distinct identifier for each name.

    The prefix keeps them apart from keywords of PROMELA and of C, into which Spin translates them.
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
    """A text as a comment of one line. What would end the comment, or has a meaning in C, is
    spaced.
    """
    line = " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("\\", "\\ ")
    return f"/* {line} */"


_WARNINGS = (Flag.UNCAUGHT_FAILURE,)
_SHARED_CLEARS = 4
"""Transitions that reset the same places share a macro from so many places on."""
_HEADINGS = {
    Kind.INTERNAL: "what the executive does by itself",
    Kind.JOIN: "joins and choices of resources that wait until nothing else can move",
    Kind.EXTERNAL: "what comes from outside",
}


@dataclass(frozen=True, slots=True)
class Assertions:
    """Assertions: places are not `full` when a token comes, `transitions` never fire, no run gets
    `stuck`, and no token is `left` on these places where a run stops, unless it failed.
    """

    full: frozenset[int] = frozenset()
    transitions: frozenset[int] = frozenset()
    stuck: bool = False
    left: frozenset[int] = frozenset()

    @classmethod
    def all_of(cls, net: PetriNet) -> "Assertions":
        """The assertions for a reader of the model: everything that is not only a warning."""
        return cls(
            frozenset(place.index for place in net.places if not place.several),
            frozenset(r.index for r in net.transitions if r.flag and r.flag not in _WARNINGS),
            True,
        )


@dataclass(slots=True)
class Model:
    """A model. `transition_at`: the transitions by line, from 1 on. `stuck_line`: the line that a
    stuck run reaches.

    `size_bytes`: an upper bound of the size of a state.
    """

    text: str
    transition_at: Mapping[int, int]
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
    """Writes one net; `encoding` says how many tokens each place has room for."""

    def __init__(
        self, net: PetriNet, encoding: Encoding, assertions: Assertions, watch: NeverClaim | None
    ) -> None:
        self.net = net
        self.assertions = assertions
        self.watch = watch
        self.most = [(1 << width) - 1 for width in encoding.width]
        self.places = identifiers("at_", [place.name for place in net.places])
        self.variables = identifiers("data_", [each.name for each in net.variables])
        self._clears: dict[tuple[int, ...], str] = {}
        self._out = _Lines()

    def write(self) -> Model:
        """Write the model, and return its text."""
        out, net = self._out, self.net
        name = net.elements.get(net.process) or net.process
        out.add(
            comment(
                f"{net.mission}, {name}: {len(net.places)} places, "
                f"{len(net.variables)} variables, {len(net.transitions)} transitions"
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
        transition_at, stuck_line = self._transitions()
        out.add("  } od", "}")
        if self.watch is not None:
            out.add("", self.watch.claim())
        return Model("\n".join(out.lines) + "\n", transition_at, stuck_line, self._size_bytes())

    def _size_bytes(self) -> int:
        watched = self.watch.size_bytes if self.watch is not None else 0
        bits = sum(1 for each in self.most if each == 1)
        return bits // 8 + 4 * (len(self.most) - bits + len(self.variables)) + watched + 200

    # --- what there is --------------------------------------------------------------------------

    def _declare(self) -> None:
        begin = dict(self.net.initial)
        for place, name, most in zip(self.net.places, self.places, self.most, strict=True):
            kind = "bit" if most == 1 else _number(most)
            said = f"{place.element}, {place.role.value}"
            if place.resources:
                said += f": {place.behavior} holds {', '.join(place.resources)}"
            if place.free:
                said += f": free of {', '.join(place.free)}"
            if place.kept:
                said += f": kept of {', '.join(place.kept)}"
            first = f" = {begin[place.index]}" if place.index in begin else ""
            self._out.add(f"{kind} {name}{first}; {comment(said)}")
        for variable, name in zip(self.net.variables, self.variables, strict=True):
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
        users: dict[tuple[int, ...], list[Transition]] = {}
        for transition in self.net.transitions:
            if len(transition.reset) >= _SHARED_CLEARS:
                users.setdefault(transition.reset, []).append(transition)
        for number, (places, transitions) in enumerate(users.items()):
            if len(transitions) > 1:
                name = self._clears[places] = f"clear_{number + 1}"
                body = " ".join(f"{self.places[p]} = 0;" for p in places)
                said = comment(f"by {', '.join(dict.fromkeys(r.element for r in transitions))}")
                self._out.add(f"inline {name}() {{ {body} }} {said}")
        if self._clears:
            self._out.add("")

    # --- transitions --------

    def _transitions(self) -> tuple[dict[int, int], int]:
        out = self._out
        transition_at: dict[int, int] = {}
        depth = 0
        if self.watch is not None and self.watch.needs_quiet:
            out.add("    if", f"    {self.watch.quiet_line()}", "    :: else ->")
            depth += 1
        for kind in Kind:
            transitions = [
                transition for transition in self.net.transitions if transition.kind is kind
            ]
            if not transitions:
                continue
            out.add("    if", f"    {comment(_HEADINGS[kind])}")
            for transition in transitions:
                out.add(f"    {self.line_of(transition)}")
                transition_at[out.last] = transition.index
            out.add("    :: else ->")
            depth += 1
        ends = " || ".join(self.places[p] for p in sorted(self.net.ends))
        left = " || ".join(self.places[p] for p in sorted(self.assertions.left))
        over = f"assert({self.places[self.net.failed]} || !({left}))" if left else "skip"
        out.add("    if", f"    :: {ends} -> {over} {comment('the run is over')}")
        stuck = "assert(false)" if self.assertions.stuck else over
        out.add(f"    :: else -> {stuck} {comment('the run is stuck')}")
        stuck_line = out.last
        out.add("    fi " + "fi " * depth)
        return transition_at, stuck_line

    def line_of(self, transition: Transition) -> str:
        """The line of a transition."""
        said = "; ".join(
            f"{step.element} {step.action.value}" + (f" {step.detail}" if step.detail else "")
            for step in transition.steps
        )
        if transition.trigger is not None:
            said = f"{transition.trigger.value} {transition.detail}".strip() + f": {said}"
        if transition.flag is not None:
            said += f" ({transition.flag.value}: {transition.flagged})"
        guard = " && ".join(self._tests(transition)) or "true"
        effects = "; ".join(self._effects(transition))
        return f":: {guard} -> d_step {{ {effects} }} {comment(f'{transition.index} {said}')}"

    def _tests(self, transition: Transition) -> list[str]:
        places = self.places
        consumed = {p for p, _ in transition.consume}
        tests = [
            "false" if n > self.most[p] else places[p] if n == 1 else f"{places[p]} >= {n}"
            for p, n in transition.consume
        ]
        tests += [places[p] for p in transition.read if p not in consumed]
        tests += [f"!{places[p]}" for p in transition.inhibit]
        tests += [f"{places[p]} <= {n}" for p, n in transition.at_most if n < self.most[p]]
        for variable, allowed in transition.guard:
            count = len(self.net.variables[variable].values)
            if len(allowed) < count:
                tests.append(one_of(self.variables[variable], sorted(allowed), count))
        return tests

    def _effects(self, transition: Transition) -> list[str]:
        """In the order of `m2pem.verify.net.petri_net`."""
        places, most = self.places, self.most
        effects: list[str] = []
        if transition.index in self.assertions.transitions:
            effects.append("assert(false)")
        for p, n in transition.consume:
            effects.append(
                f"{places[p]} = 0" if most[p] == 1 else f"{places[p]} = {places[p]} - {n}"
            )
        for pairs, gone in ((transition.moves, True), (transition.copies, False)):
            for source, target in pairs:
                counts = self.net.places[target].counts_moves and target not in transition.reset
                if counts and target in self.assertions.full:
                    effects.append(f"assert({places[target]} <= {most[target]} - {places[source]})")
                effects.append(self._all_of(source, target))
                if gone:
                    effects.append(f"{places[source]} = 0")
        if transition.reset in self._clears:
            effects.append(f"{self._clears[transition.reset]}()")
        else:
            effects += [f"{places[p]} = 0" for p in transition.reset]
        refilled = {target for _, target in (*transition.moves, *transition.copies)}
        emptied = {p for p, _ in transition.consume if most[p] == 1} - refilled | set(
            transition.reset
        )
        for p, n in transition.produce:
            if p in self.assertions.full and not (p in emptied and n <= most[p]):
                effects.append(f"assert({places[p]} <= {most[p] - n})")
            effects.append(self._more(p, n))
        effects += [f"{self.variables[v]} = {value}" for v, value in transition.assign]
        if self.watch is not None:
            effects += self.watch.after_transition(transition.index)
        return effects or ["skip"]

    def _all_of(self, source: int, p: int) -> str:
        """Add as many tokens as another place has, up to the number that there is room for."""
        other, name, most = self.places[source], self.places[p], self.most[p]
        fits = f"{name} + {other} <= {most} -> {name} = {name} + {other}"
        return f"if :: {fits} :: else -> {name} = {most} fi"

    def _more(self, p: int, n: int) -> str:
        """Add tokens, up to the number that there is room for."""
        name, most = self.places[p], self.most[p]
        if most <= n:
            return f"{name} = {most}"
        return f"if :: {name} <= {most - n} -> {name} = {name} + {n} :: else -> {name} = {most} fi"


def text_of(
    net: PetriNet,
    encoding: Encoding | None = None,
    assertions: Assertions | None = None,
    watch: NeverClaim | None = None,
) -> Model:
    """Return the model; by default everything that is a violation is asserted."""
    encoding = encoding or Encoding(net)
    return Writer(net, encoding, assertions or Assertions.all_of(net), watch).write()


def one_of(variable: str, allowed: Sequence[int], count: int) -> str:
    """The condition that a variable has one of some of its `count` values."""
    if not allowed:
        return "false"
    missing = sorted(set(range(count)) - set(allowed))
    if len(missing) < len(allowed):
        return "(" + " && ".join(f"{variable} != {n}" for n in missing) + ")"
    return "(" + " || ".join(f"{variable} == {n}" for n in allowed) + ")"


def _number(most: int) -> str:
    return "byte" if most <= 255 else "short" if most <= 32_767 else "int"
