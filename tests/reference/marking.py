"""A state of the token game: tokens on flows, and the activities and events they are in.

A marking is a tree. A `Scope` is one instance of a process or subprocess: tokens on its flows and
the `Work` in it. A `Work` is a token inside a node: a task that is done, an event or a gateway
that waits, a subprocess (with a scope inside), an activity that repeats (with instances inside).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from tests.reference.diagram import Level, Node

Key = tuple[object, ...]


class Tokens(dict[str, int]):
    """How many tokens are on a flow, or have been; on most there is none."""

    def __missing__(self, flow: str) -> int:
        return 0


@dataclass(eq=False, slots=True)
class Work:
    number: int
    node: Node
    home: "Scope"
    inside: "Scope | None" = None
    whole: "Work | None" = None  # of an instance: the repeating activity it belongs to
    instances: "list[Work] | None" = None  # of a repeating activity
    begun: int = 0
    completed: int = 0
    caught: bool = False  # the event has happened; what is left is to follow the flows out of it

    @property
    def has_not_begun(self) -> bool:
        """Of a repeating activity: its token has come, and no instance has begun."""
        return self.instances == [] and not self.begun

    def key(self) -> Key:
        inside = () if self.inside is None else self.inside.key()
        instances = sorted_keys(self.instances or ())
        return (self.node.id, inside, instances, self.begun, self.completed, self.caught)


@dataclass(eq=False, slots=True)
class Scope:
    number: int
    level: Level
    owner: Work | None
    tokens: Tokens = field(default_factory=Tokens)
    works: list[Work] = field(default_factory=list)
    # Complex gateways that wait for their reset, with the flows consumed from in the first phase.
    fired: dict[str, frozenset[str]] = field(default_factory=dict)
    interrupted: bool = False  # an interrupting event subprocess has begun
    terminated: bool = False

    def is_empty(self) -> bool:
        return not self.works and not self.tokens

    def handles_events(self) -> bool:
        """Whether event subprocesses may begin: the parent runs, uninterrupted (13.5.4)."""
        proper = self.tokens or any(w.node.kind != "event_subprocess" for w in self.works)
        return bool(proper) and not self.interrupted

    def key(self) -> Key:
        fired = tuple(sorted((gateway, tuple(sorted(f))) for gateway, f in self.fired.items()))
        tokens = tuple(sorted(self.tokens.items()))
        return (tokens, sorted_keys(self.works), fired, self.interrupted, self.terminated)


@dataclass(eq=False, slots=True)
class Marking:
    numbers: int = 0
    root: Scope | None = None  # None: the run has ended
    outcome: str | None = None
    answers: dict[str, str | bool] = field(default_factory=dict)
    taken: Tokens = field(default_factory=Tokens)  # since the last input

    def key(self) -> Key:
        root = None if self.root is None else self.root.key()
        return (self.outcome, root, tuple(sorted(self.answers.items())), self.seen())

    def seen(self) -> tuple[tuple[str, int], ...]:
        """The flows taken since the last input, how often each."""
        return tuple(sorted(self.taken.items()))

    def next_number(self) -> int:
        self.numbers += 1
        return self.numbers

    def scopes(self) -> Iterator[Scope]:
        stack = [] if self.root is None else [self.root]
        while stack:
            scope = stack.pop()
            yield scope
            for work in leaves(scope.works):
                if work.inside is not None:
                    stack.append(work.inside)

    def works(self) -> Iterator[Work]:
        """Every single work and instance (a repeating activity is its instances)."""
        for scope in self.scopes():
            yield from leaves(scope.works)

    def copy(self) -> "Marking":
        """An equal marking that shares nothing; numbers stay the same."""
        copied = Marking(self.numbers, None, self.outcome, dict(self.answers), Tokens(self.taken))
        if self.root is not None:
            copied.root = _copy_scope(self.root, None)
        return copied

    def scope(self, number: int) -> Scope | None:
        return next((scope for scope in self.scopes() if scope.number == number), None)

    def work(self, number: int) -> Work | None:
        """The single work, instance or repeating activity of that number, if it is still there."""
        for scope in self.scopes():
            for work in scope.works:
                if work.number == number:
                    return work
                for instance in work.instances or ():
                    if instance.number == number:
                        return instance
        return None


def leaves(works: list[Work]) -> Iterator[Work]:
    for work in works:
        if work.instances is None:
            yield work
        else:
            yield from work.instances


def sorted_keys(works: Sequence[Work]) -> tuple[Key, ...]:
    return tuple(sorted(work.key() for work in works))


def _copy_scope(scope: Scope, owner: Work | None) -> Scope:
    copied = Scope(scope.number, scope.level, owner, Tokens(scope.tokens))
    copied.works = [_copy_work(work, copied, None) for work in scope.works]
    copied.fired = dict(scope.fired)
    copied.interrupted = scope.interrupted
    copied.terminated = scope.terminated
    return copied


def _copy_work(work: Work, home: Scope, whole: Work | None) -> Work:
    copied = Work(work.number, work.node, home, None, whole, None, work.begun, work.completed)
    copied.caught = work.caught
    if work.inside is not None:
        copied.inside = _copy_scope(work.inside, copied)
    if work.instances is not None:
        copied.instances = [_copy_work(each, home, copied) for each in work.instances]
    return copied
