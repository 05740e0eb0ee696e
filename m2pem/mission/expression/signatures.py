"""What a function of an expression takes and gives, as a text says it.

`substring(string: text, start position: number, length?: number) -> text`: each parameter with its
kinds, separated by `|`, or without any where it takes all, null too. A `?` follows the name of
one that may be left out; `...` says that the last one may be there several times.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from m2pem.errors import ExpressionError
from m2pem.mission.expression.operators import TEXT_AS_VALUE, describe, kind, look_at
from m2pem.mission.expression.temporal import DAYS, MONTHS, Computed

Kinds = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter: its name, the kinds it takes (none: all, null too), and whether it may be left
    out or be null."""

    name: str
    kinds: Kinds = ()
    optional: bool = False


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the bare dialect, or of XPath. Unless a parameter takes null, a null argument
    makes the result null.

    `gives`: the kinds of its values, besides null; none: any. `doc`: what it gives, for people.
    `repeated`: the last parameter may be there several times. `others`: other ways to call it.
    """

    name: str
    parameters: tuple[Parameter, ...]
    gives: Kinds
    compute: Callable[..., Computed]
    doc: str = ""
    repeated: bool = False
    others: tuple[Self, ...] = ()
    _least: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_least", sum(not each.optional for each in self.parameters))

    @property
    def ways(self) -> "tuple[Self, ...]":
        """This way to call it, and the others."""
        return (self, *self.others)

    @property
    def signature(self) -> str:
        """How it is called: `substring(string, start position, length?)`."""
        names = [f"{each.name}?" if each.optional else each.name for each in self.parameters]
        return f"{self.name}({', '.join([*names, '...'] if self.repeated else names)})"

    def accepts(self, count: int) -> bool:
        """Whether it may be called so with so many arguments."""
        return count >= self._least and (count <= len(self.parameters) or self.repeated)

    def fits(self, given: Sequence[frozenset[str]]) -> bool:
        """Whether arguments of some kinds can give a value."""
        return all(
            not self._parameter(place).kinds or not kinds.isdisjoint(self._parameter(place).kinds)
            for place, kinds in enumerate(given)
        )

    def of(self, count: int) -> Callable[[Sequence[Computed]], Computed]:
        """What calls it with so many arguments."""
        return self.call

    def call(self, arguments: Sequence[Computed]) -> Computed:
        """Return the function's value; raises ExpressionError."""
        null = False
        for place, argument in enumerate(arguments):
            kinds = self._parameter(place).kinds
            if argument is None and kinds:
                null = True
            elif kinds and kind(argument) not in kinds:
                wanted = " or ".join(kinds)
                raise ExpressionError(f"{self.name}() takes a {wanted}, not {describe(argument)}")
            elif isinstance(argument, list):
                look_at(len(argument))
            elif isinstance(argument, str):
                look_at(len(argument) // TEXT_AS_VALUE)
        return None if null else self.compute(*arguments)

    def _parameter(self, place: int) -> Parameter:
        return self.parameters[min(place, len(self.parameters) - 1)]

    @classmethod
    def table(cls, rows: Iterable[tuple[str, Callable[..., Computed], str]]) -> dict[str, Self]:
        """The functions by name: the signature of each, what computes it, and its `doc`.

        A name that comes again is another way to call the function.
        """
        found: dict[str, Self] = {}
        for text, compute, doc in rows:
            name, _, rest = text.partition("(")
            inside, _, gives = rest.rpartition(")")
            names = inside.split(", ") if inside else []
            repeated = "..." in names
            parameters = tuple(map(_parameter, names[:-1] if repeated else names))
            each = cls(name, parameters, _kinds(gives[4:]), compute, doc, repeated)
            if name in found:
                each = replace(found[name], others=(*found[name].others, each))
            found[name] = each
        return found


def _parameter(text: str) -> Parameter:
    name, _, kinds = text.partition(": ")
    return Parameter(name.removesuffix("?"), _kinds(kinds), name.endswith("?"))


def _kinds(text: str) -> Kinds:
    """Kinds as a signature writes them; `duration` is both of FEEL's."""
    found = text.split("|") if text else []
    return tuple(
        each for one in found for each in ((DAYS, MONTHS) if one == "duration" else (one,))
    )
