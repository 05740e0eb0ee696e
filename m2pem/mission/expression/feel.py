"""Parses FEEL (DMN 1.5, clause 10.3.1.2).

Names may hold spaces and signs: those of contexts, variables and functions are known as they are
written; of other names, words that follow each other are one name.
"""

import math
import re
from bisect import bisect_left
from collections.abc import Iterable, Sequence

from m2pem.mission.expression import tree as t
from m2pem.mission.expression.calls import CallError, feel_call
from m2pem.mission.expression.descent import MAX_ITEMS, Descent
from m2pem.mission.expression.dialect import Span
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS

_TOKEN = re.compile(
    r"\s*(?:(?://[^\n]*|/\*.*?\*/)\s*)*"
    r"((?:[^\W\d]|[\U00010000-\U000EFFFF])[\w\U00010000-\U000EFFFF]*"
    r"|(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?(?![\w\U00010000-\U000EFFFF]|\.(?!\.))"
    r'|"[^"\\]*(?:\\.[^"\\]*)*"'
    r"|\*\*|\.\.|->|<=|>=|!=|\.(?![0-9])|/(?![/*])|[-+*()\[\]{},:<>=@]|)",
    re.DOTALL,
)
"""A token after space and comments: a word, number, text or sign; "" for the end and what is no
token."""

_NUMBER = re.compile(r"(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_INSIDE = re.compile(r"[\w\U00010000-\U000EFFFF]")
_PART = re.compile(r"[\w\U00010000-\U000EFFFF]+|[^\s\w]")
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{6})|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "\\": "\\", '"': '"', "'": "'"}
KEYWORDS = frozenset(
    {
        *("and", "between", "else", "every", "false", "for", "function", "if", "in", "instance"),
        *("null", "or", "return", "satisfies", "some", "then", "true"),
    }
)
_COMPARISONS = {
    "=": t.Comparison.EQUAL,
    **{each.value: each for each in t.Comparison if each is not t.Comparison.EQUAL},
}
_OPERATIONS = {each.value: each for each in t.Operation}
_AFTER = frozenset({".", "[", "(", "instance"})
_EXACT_DIGITS = 15
_AND, _COMPARISON = 2, 3
_STRENGTHS = {
    **{"or": 1, "and": _AND, "between": _COMPARISON, "in": _COMPARISON, "**": 6},
    **dict.fromkeys(_COMPARISONS, _COMPARISON),
    **dict.fromkeys("+-", 4),
    **dict.fromkeys("*/", 5),
}
"""How strongly an operator binds."""

_SPELLED = KEYWORDS | _STRENGTHS.keys() | {"..", "->", *"()[]{},.:@"}
_KINDS = {"": "end", '"': "text", **dict.fromkeys("0123456789.", "number")}
"""The kind of a token by its first character: "name" of all others."""

_CONSTANTS = {"true": True, "false": False, "null": None}
_PROPERTIES = ("time offset", "start included", "end included")
_TYPES = [
    each.split()
    for each in (
        *("years and months duration", "days and time duration", "date and time", "date", "time"),
        *("Any", "number", "string", "boolean", "list", "context", "range", "function", "Null"),
    )
]
_FUNCTIONS: dict[str, list[list[str]]] = {"not": [["not"]]}
"""The words of functions that have several, by the first one; the longest names come first."""

for _name in sorted(FEEL_FUNCTIONS, key=len, reverse=True):
    if " " in _name:
        _FUNCTIONS.setdefault(_name.split()[0], []).append(_name.split())


class FeelParser(Descent):
    """Reads one expression in FEEL, which is in `text` at `span`."""

    def __init__(self, text: str, span: Span) -> None:
        self._text = text
        self._span = span
        self._tokens: list[str] = _TOKEN.findall(text, span.start, span.stop)
        self._starts: list[int] = []
        self._last = -1
        self._names: dict[str, re.Pattern[str]] = {}
        self._locals: list[str] = []
        self._in_range = False
        self._next()

    # --- tokens -----------------------------------------------------------------------------------

    def _next(self) -> str:
        read = self._token
        self._first = self._last = at = self._last + 1
        self._token = token = self._tokens[at]
        if self._names and self._written(at):
            return read
        if token in _SPELLED:
            self._kind = token
            return read
        self._kind = kind = _KINDS.get(token[:1], "name")
        if kind == "name":
            self._name(token)
        elif kind == "end" and at + 1 < len(self._tokens):
            self._unexpected(self._place(at))
        return read

    def _name(self, word: str) -> None:
        """Read the other words of a name."""
        tokens, last = self._tokens, self._last
        for words in _FUNCTIONS.get(word, ()):
            after = last + len(words)
            if tokens[last:after] == words and tokens[after] == "(":
                self._token, self._last = " ".join(words), after - 1
                return
        if word == "not":
            self._fail("expected '(' after FEEL's 'not'", last + 1)
        while (following := tokens[last + 1]) not in _SPELLED:
            if following[:1] in _KINDS or word in self._locals or word in FEEL_FUNCTIONS:
                break
            word, last = f"{word} {following}", last + 1
        self._token, self._last = word, last

    def _place(self, token: int) -> int:
        if not self._starts:
            self._starts = self._starts_from(self._span.start)
        return self._starts[token]

    def _starts_from(self, position: int) -> list[int]:
        found = _TOKEN.finditer(self._text, position, self._span.stop)
        return [each.start(1) for each in found]

    def _written(self, at: int) -> bool:
        """Read a name that was defined and holds spaces or signs, if it is next."""
        start, stop = self._place(at), self._span.stop
        for name, pattern in self._names.items():
            found = pattern.match(self._text, start, stop)
            if found and not (
                _INSIDE.match(self._text, found.end(), stop) and _INSIDE.match(found[0][-1])
            ):
                self._kind, self._token = "name", name
                self._skip_to(found.end())
                return True
        return False

    def _skip_to(self, position: int) -> None:
        """Let the next token be that after a position, which may be within one."""
        at = bisect_left(self._starts, position, self._first)
        if self._starts[at - 1] + max(1, len(self._tokens[at - 1])) > position:
            tokens = _TOKEN.findall(self._text, position, self._span.stop)
            self._tokens[at:], self._starts[at:] = tokens, self._starts_from(position)
        self._last = at - 1

    def _unexpected(self, start: int) -> None:
        if start == self._span.stop:
            return
        if number := _NUMBER.match(self._text, start, self._span.stop):
            following = self._text[number.end()]
            self._refuse(f"a number cannot be followed by {following!r}", number.end())
        character = self._text[start]
        if character == '"':
            self._refuse('the text is not closed by "', start)
        hints = {"'": 'write texts in double quotes: "..."', "!": "write not(...)"}
        hints |= {"?": "write 'if a then b else c'"}
        hints |= {"&": "write 'and'", "|": "write 'or'", "%": "write modulo(x, y)"}
        hint = hints.get(character)
        self._refuse(f"unexpected {character!r}" + (f": {hint}" if hint else ""), start)

    def _known(self, name: str) -> str:
        """Note a name that may hold spaces and signs, and return it without more spaces."""
        parts = _PART.findall(name)
        if len(parts) > 1:
            pattern = r"\s*".join(map(re.escape, parts))
            pattern = re.sub(r"(?<=\w)\\s\*(?=\w)", r"\\s+", pattern)
            self._names[name] = re.compile(pattern)
        return name

    # --- expressions ------------------------------------------------------------------------------

    def _expression(self) -> t.Node:
        self._nest()
        kind = self._kind
        if kind == "if":
            node = self._if()
        elif kind in ("for", "some", "every"):
            node = self._iteration(self._next())
        else:
            node = self._operators()
        self._nesting -= 1
        return node

    def _if(self) -> t.Node:
        self._next()
        condition = self._expression()
        self._expect("then", "after 'if'")
        then = self._expression()
        self._expect("else", "after 'if'")
        return t.If(condition, then, self._expression())

    def _iteration(self, word: str) -> t.Node:
        known = len(self._locals)
        iterators: list[tuple[str, t.Node]] = []
        while not iterators or self._take(","):
            name = self._variable(f"after '{word}'")
            self._expect("in", f"after '{word}'")
            low = self._expression()
            if self._take(".."):
                low = t.RangeOf(low, self._expression(), True, True, descends=True)
            iterators.append((name, low))
            self._locals.append(name)
        if word == "for":
            self._locals.append("partial")
        self._expect("return" if word == "for" else "satisfies", f"after '{word}'")
        node = self._expression()
        del self._locals[known:]
        if word == "for":
            return t.For(tuple(iterators), node)
        for name, collection in reversed(iterators):
            node = (t.Some if word == "some" else t.Every)(name, collection, node)
        return node

    def _variable(self, why: str) -> str:
        """A name that is defined here: all up to what follows it."""
        if self._kind != "name":
            self._fail(f"expected a name {why}, found {self._found}")
        return self._known(self._next())

    def _operators(self, minimum: int = 0) -> t.Node:
        """The longest expression whose operators bind more strongly than `minimum`."""
        node = self._signed() if self._kind == "-" else self._value()
        while (strength := _STRENGTHS.get(self._kind, 0)) > minimum:
            node = self._binary(node, strength)
        return node

    def _binary(self, left: t.Node, strength: int) -> t.Node:
        if strength <= _AND:
            return self._joined(left, strength, self._operators)
        word = self._next()
        if strength > _COMPARISON:
            return t.Arithmetic(_OPERATIONS[word], left, self._operators(strength))
        if word == "in":
            node = self._tests(left)
        elif word == "between":
            low = self._operators(_COMPARISON)
            self._expect("and", "after 'between'")
            node = _within(left, t.RangeOf(low, self._operators(_COMPARISON), True, True))
        else:
            node = t.Compare(_COMPARISONS[word], left, self._operators(_COMPARISON))
        if _STRENGTHS.get(self._kind) == _COMPARISON:
            self._fail("comparisons do not chain; write 'a < b and b < c', or use parentheses")
        return node

    def _signed(self) -> t.Node:
        negative = 0
        while self._take("-"):
            negative += 1
            if negative > t.MAX_DEPTH:
                self._fail(f"nested deeper than {t.MAX_DEPTH} levels")
        node = self._value()
        if isinstance(node, t.Literal) and _is_number(node):
            return t.Literal(-node.value if negative % 2 else node.value)  # type: ignore[operator]
        for _ in range(negative):
            node = t.Negate(node)
        return node

    # --- values -----------------------------------------------------------------------------------

    def _value(self) -> t.Node:
        node = self._primary()
        while (kind := self._kind) in _AFTER:
            if kind == ".":
                node = self._member(node)
            elif kind == "[":
                if self._in_range and _is_number(node):
                    return node
                self._next()
                self._locals.append("item")
                node = t.Filter(node, self._expression())
                self._locals.pop()
                self._expect("]", "to close '['")
            elif kind == "instance":
                if self._tokens[self._last + 1] != "of":
                    self._next()
                    self._fail(f"expected 'of' after 'instance', found {self._found}")
                self._last += 1
                self._next()
                node = t.InstanceOf(node, self._type())
            elif isinstance(node, t.Name):
                return node
            else:
                node = t.Invoke(node, *self._arguments())
        return node

    def _member(self, node: t.Node) -> t.Node:
        self._next()
        first = self._first
        name = " ".join(self._tokens[first : first + 2])
        if name in _PROPERTIES:
            self._last = first + 1
            self._next()
            return t.Path(node, name)
        if self._kind != "name" and self._kind not in KEYWORDS:
            self._fail(f"expected a name after '.', found {self._found}")
        name = self._next()
        if isinstance(node, t.Name) and node.name.partition(".")[0] not in self._locals:
            return t.Name(f"{node.name}.{name}")
        return t.Path(node, name)

    def _primary(self) -> t.Node:
        kind, token = self._kind, self._token
        match kind:
            case "number":
                self._next()
                if token.isdecimal() and len(token) <= _EXACT_DIGITS:
                    return t.Literal(int(token))
                if len(token) > _EXACT_DIGITS or math.isinf(value := float(token)):
                    return t.Call("FEEL number", (t.Literal(token),))  # a double has not all of it
                return t.Literal(value)
            case "name":
                first = self._first
                self._next()
                return self._call(token, first) if self._kind == "(" else t.Name(token)
            case "text":
                return t.Literal(self._quoted())
            case "[" | "]" | "(":
                return self._bracketed()
            case "{":
                return self._context()
            case "true" | "false" | "null":
                self._next()
                return t.Literal(_CONSTANTS[token])
            case "@":
                self._next()
                if self._kind != "text":
                    self._fail("expected a text after '@'")
                return t.Call("FEEL @", (t.Literal(self._quoted()),))
            case "function":
                return self._function()
        self._fail(f"expected a value, found {self._found}")

    def _quoted(self) -> str:
        text = self._next()[1:-1]
        return _unescaped(text) if "\\" in text else text

    def _call(self, name: str, first: int) -> t.Node:
        if name == "not":
            self._next()
            node = self._expression()
            self._expect(")", "to close 'not('")
            return t.Not(node)
        arguments, names = self._arguments()
        if name in self._locals:
            return t.Invoke(t.Name(name), arguments, names)
        try:
            return feel_call(name, arguments, names)
        except CallError as error:
            self._fail(str(error), first)

    def _arguments(self) -> tuple[tuple[t.Node, ...], tuple[str, ...]]:
        self._next()
        arguments: list[t.Node] = []
        names: list[str] = []
        while self._kind != ")":
            if arguments and not self._take(","):
                break
            if len(arguments) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            if named := self._label():
                names.append(named)
            elif names:
                self._fail("all arguments have names, or none")
            arguments.append(self._expression())
        self._expect(")", "to close the arguments")
        if names and len(names) < len(arguments):
            self._fail("all arguments have names, or none")
        return tuple(arguments), tuple(names)

    def _label(self) -> str:
        """Read the name of an argument and the colon after it; "": there is none."""
        tokens, at = self._tokens, self._first
        if self._kind != "name" and self._kind not in KEYWORDS:
            return ""
        while tokens[at][:1] not in _KINDS and (
            tokens[at] not in _SPELLED or tokens[at] in KEYWORDS
        ):
            at += 1
        if tokens[at] != ":":
            return ""
        name = " ".join(tokens[self._first : at])
        self._last = at
        self._next()
        return name

    def _function(self) -> t.Node:
        self._next()
        self._expect("(", "after 'function'")
        known, parameters = len(self._locals), list[str]()
        while self._kind != ")":
            if parameters:
                self._expect(",", "between parameters")
            name = self._variable("of a parameter")
            if self._take(":"):
                self._type()
            parameters.append(name)
        self._locals += parameters
        self._expect(")", "to close the parameters")
        if self._token == "external":
            self._fail("functions of Java or PMML are not run")
        body = self._expression()
        del self._locals[known:]
        return t.Lambda(tuple(parameters), body)

    def _context(self) -> t.Node:
        opening = self._first
        self._next()
        known = len(self._locals)
        entries: list[tuple[str, t.Node]] = []
        while self._kind != "}":
            if entries and not self._take(","):
                break
            key = self._key()
            if key in (each for each, _ in entries):
                self._fail(f"the key {key!r} is there twice")
            entries.append((key, self._expression()))
            self._locals.append(self._known(key))
            if len(entries) > MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            if self._names:
                self._last = self._first - 1
                self._next()  # with the key as a name
        self._expect("}", "to close '{'", opening)
        del self._locals[known:]
        return t.ContextOf(tuple(entries))

    def _key(self) -> str:
        if self._kind == "text":
            key = self._quoted()
            self._expect(":", "after a key")
            return key
        named = self._kind == "name" or self._kind in KEYWORDS
        if named and not self._names and self._tokens[self._last + 1] == ":":
            key = self._token
            self._last += 1
            self._next()
            return key
        start = self._position
        colon = self._text.find(":", start, self._span.stop)
        if colon < 0 or not named:
            self._fail(f"expected a key, found {self._found}")
        key = re.sub(r"\s+", " ", self._text[start:colon].strip())
        if re.search(r'[\[\](){}",:]', key):
            self._fail("expected ':' after a key")
        self._skip_to(colon + 1)
        self._next()
        return key

    def _bracketed(self) -> t.Node:
        """A list, a range, or an expression in parentheses."""
        opening = self._first
        bracket = self._next()
        if bracket == "(" and self._kind in _COMPARISONS:
            node = self._open_range()
            self._expect(")", "to close '('")
            return node
        if bracket == "[" and self._take("]"):
            return t.ListOf(())
        items = [self._item(bracket)]
        if self._take(".."):
            return self._to_end(items[0], bracket == "[")
        if bracket == "]":
            self._expect("..", "in a range")
        if bracket == "(":
            self._expect(")", "to close '('", opening)
            return items[0]
        while self._take(","):
            if len(items) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            items.append(self._item(bracket))
        self._expect("]", "to close '['", opening)
        return t.ListOf(tuple(items))

    def _to_end(self, low: t.Node, included: bool) -> t.RangeOf:
        """The range with its high end; a [ after a number closes it."""
        outer, self._in_range = self._in_range, True
        high = self._expression()
        self._in_range = outer
        if self._kind not in ("]", ")", "["):
            self._fail("expected ']' or ')' to close the range")
        return t.RangeOf(low, high, included, self._next() == "]")

    def _item(self, bracket: str) -> t.Node:
        if bracket == "[" and self._kind in _COMPARISONS and self._kind != "=":
            return self._open_range()
        return self._expression()

    def _open_range(self) -> t.Node:
        """`< x` and the like, as a range."""
        operator = self._next()
        value = self._operators(_COMPARISON)
        match operator:
            case "<" | "<=":
                return t.RangeOf(None, value, False, operator == "<=")
            case ">" | ">=":
                return t.RangeOf(value, None, operator == ">=", False)
            case "=":
                return t.RangeOf(value, value, True, True)
        return t.RangeOf(value, None, False, False, negated=True)

    def _tests(self, left: t.Node) -> t.Node:
        """What follows `in`: a test, or some of them in parentheses."""
        if self._kind in _COMPARISONS:
            return self._test(left)
        if self._kind != "(":
            return _within(left, self._operators(_COMPARISON))
        opening = self._first
        self._next()
        tests = [self._test(left)]
        if self._take(".."):
            return _within(left, self._to_end(self._low, False))
        while self._take(","):
            tests.append(self._test(left))
        self._expect(")", "to close '('", opening)
        items = [each.container for each in tests if isinstance(each, t.In)]
        if len(items) == len(tests) and all(isinstance(each, t.Literal) for each in items):
            return t.In(left, t.ListOf(tuple(items)))
        return t.Or(tuple(tests)) if len(tests) > 1 else tests[0]

    def _test(self, left: t.Node) -> t.Node:
        if self._kind in _COMPARISONS:
            operator = _COMPARISONS[self._next()]
            return t.Compare(operator, left, self._operators(_COMPARISON))
        self._low = self._expression()
        return _within(left, self._low)

    # --- types ------------------------------------------------------------------------------------

    def _type(self) -> t.TypeName:
        first = self._first
        for words in _TYPES:
            after = first + len(words)
            if self._tokens[first:after] == words:
                self._last = after - 1
                self._next()
                name = " ".join(words)
                return name, tuple(self._parts(name))
        self._fail(f"expected a type such as number or list<string>, found {self._found}")

    def _parts(self, name: str) -> Iterable[tuple[str, t.TypeName]]:
        parts = list[tuple[str, t.TypeName]]()
        if name not in ("list", "context", "range", "function") or not self._take("<"):
            return parts
        while self._kind != ">":
            if parts:
                self._expect(",", "between types")
            key = self._key() if name == "context" else ""
            parts.append((key, self._type()))
        self._expect(">", "to close the type")
        if name == "function":
            self._expect("->", "before the type of a function's values")
            parts.append(("->", self._type()))
        return parts


def _within(item: t.Node, container: t.Node) -> t.Node:
    """`item in container`; of a range, as comparisons, which a verifier translates."""
    if not isinstance(container, t.RangeOf) or container.low is None or container.high is None:
        return t.In(item, container)
    above = t.Comparison.GREATER_EQUAL if container.low_included else t.Comparison.GREATER
    below = t.Comparison.LESS_EQUAL if container.high_included else t.Comparison.LESS
    return t.And((t.Compare(above, item, container.low), t.Compare(below, item, container.high)))


def _is_number(node: t.Node) -> bool:
    return isinstance(node, t.Literal) and type(node.value) in (int, float)


def _unescaped(text: str) -> str:
    def replaced(found: re.Match[str]) -> str:
        if code := found[1] or found[2]:
            value = int(code, 16)
            return chr(value) if value <= 0x10FFFF else found[0]
        return _ESCAPED.get(found[3], found[0])

    written = _ESCAPE.sub(replaced, text)
    return written.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


__all__: Sequence[str] = ("FeelParser",)
