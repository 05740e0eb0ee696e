"""Parses FEEL (DMN 1.5, clause 10.3.1.2).

Names may hold spaces and signs: those of contexts, variables and functions are known as they are
written; of other names, words that follow each other are one name.
"""

import re
from collections.abc import Iterable, Sequence
from typing import NoReturn

from m2pem.mission.expression.calls import CallError, feel_call
from m2pem.mission.expression.descent import MAX_ITEMS, Descent, Token
from m2pem.mission.expression.dialect import Span
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS, NAME_HEADS, NAMES
from m2pem.mission.expression.literals import read_number
from m2pem.mission.expression.tree import (
    MAX_DEPTH,
    And,
    Arithmetic,
    Call,
    Compare,
    Comparison,
    ContextOf,
    Every,
    Filter,
    For,
    If,
    In,
    InstanceOf,
    Invoke,
    Lambda,
    ListOf,
    Literal,
    Name,
    Negate,
    Node,
    Not,
    Operation,
    Or,
    Path,
    RangeOf,
    Some,
    TypeName,
)

_BETWEEN = r"(?:\s|//[^\n]*(?:\n|\Z)|/\*.*?\*/)*"
_WORD_TEXT = r"(?:[^\W\d]|[\U00010000-\U000EFFFF])[\w\U00010000-\U000EFFFF]*"
_SPACE = re.compile(_BETWEEN, re.DOTALL)
_WORD = re.compile(_WORD_TEXT)
_NEXT = re.compile(
    rf"{_BETWEEN}(?:(?P<word>{_WORD_TEXT})"
    r"|(?P<number>(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r'|(?P<text>"(?:[^"\\]|\\.)*")'
    r"|(?P<sign>\*\*|\.\.|->|<=|>=|!=|/(?![/*])|[-+*()\[\]{},.:<>=@]))",
    re.DOTALL,
)
"""A token and the space and comments before it; its group is its kind."""

_INSIDE = re.compile(r"[\w\U00010000-\U000EFFFF]")
_NAMED = re.compile(r"([^\W\d]\w*(?:\s+\w+)*)\s*:(?!=)")
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
    "=": Comparison.EQUAL,
    **{each.value: each for each in Comparison if each is not Comparison.EQUAL},
}
_EXACT_DIGITS = 15
_AND, _COMPARISON = 2, 3
_STRENGTHS = {
    **{"or": 1, "and": _AND, "between": _COMPARISON, "in": _COMPARISON, "**": 6},
    **dict.fromkeys(_COMPARISONS, _COMPARISON),
    **dict.fromkeys("+-", 4),
    **dict.fromkeys("*/", 5),
}
"""How strongly an operator binds."""

_PROPERTIES = ("time offset", "start included", "end included")
_TYPES = (
    *("years and months duration", "days and time duration", "date and time", "date", "time"),
    *("Any", "number", "string", "boolean", "list", "context", "range", "function", "Null"),
)


_new = tuple.__new__  # takes half as long as calling the class


class FeelParser(Descent):
    """Reads one expression in FEEL, which is in `text` at `span`."""

    def __init__(self, text: str, span: Span) -> None:
        self._text = text
        self._stop = span.stop
        self._names: dict[str, re.Pattern[str]] = {}
        self._locals: list[str] = []
        self._in_range = False
        self._token = self._read(span.start)

    # --- tokens -----------------------------------------------------------------------------------

    def _read(self, position: int) -> Token:
        if self._names and (named := self._written(position)):
            return named
        found = _NEXT.match(self._text, position, self._stop)
        if found is None:
            return self._end_of_text(position)
        kind = found.lastgroup or ""
        if kind == "word":
            return self._name(found["word"], found.start("word"), found.end())
        if kind == "number":
            self._alone(found)
        strength = _STRENGTHS.get(found[kind], 0) if kind == "sign" else 0
        return _new(Token, (kind, found[kind], found.start(kind), found.end(), strength))

    def _end_of_text(self, position: int) -> Token:
        start = self._after_space(position)
        if start < self._stop:
            self._refuse(start)
        return _new(Token, ("end", "the end", self._stop, self._stop, 0))

    def _after_space(self, position: int) -> int:
        space = _SPACE.match(self._text, position, self._stop)
        return space.end() if space else position

    def _written(self, position: int) -> Token | None:
        """A name that was defined and holds spaces or signs, if it is next."""
        start = self._after_space(position)
        for key, pattern in self._names.items():
            named = pattern.match(self._text, start, self._stop)
            if named and not self._goes_on(named):
                return _new(Token, ("name", key, start, named.end(), 0))
        return None

    def _goes_on(self, found: re.Match[str]) -> bool:
        return bool(
            _INSIDE.match(self._text, found.end(), self._stop) and _INSIDE.match(found[0][-1])
        )

    def _name(self, word: str, start: int, stop: int) -> Token:
        if word in NAME_HEADS:
            for pattern, name in NAMES:
                if found := pattern.match(self._text, start, self._stop):
                    return _new(Token, ("name", name, start, found.end(1), 0))
        if word == "not":
            self._fail("expected '(' after FEEL's 'not'", self._after_space(stop))
        if word in KEYWORDS:
            return _new(Token, ("word", word, start, stop, _STRENGTHS.get(word, 0)))
        text = word
        while text not in self._locals and text not in FEEL_FUNCTIONS:
            following = _NEXT.match(self._text, stop, self._stop)
            if following is None or following.lastgroup != "word":
                break
            if following["word"] in KEYWORDS:
                break
            text, stop = f"{text} {following['word']}", following.end()
        return _new(Token, ("name", text, start, stop, 0))

    def _alone(self, number: re.Match[str]) -> None:
        following = self._text[number.end() : number.end() + 1]
        if number.end() < self._stop and _INSIDE.match(following):
            self._fail(f"a number cannot be followed by {following!r}", number.end())
        if following == "." and self._text[number.end() : number.end() + 2] != "..":
            self._fail("a number cannot be followed by '.'", number.end())

    def _refuse(self, start: int) -> NoReturn:
        character = self._text[start]
        if character == '"':
            self._fail('the text is not closed by "', start)
        hints = {"'": 'write texts in double quotes: "..."', "!": "write not(...)"}
        hints |= {"?": "write 'if a then b else c'"}
        hints |= {"&": "write 'and'", "|": "write 'or'", "%": "write modulo(x, y)"}
        hint = hints.get(character)
        self._fail(f"unexpected {character!r}" + (f": {hint}" if hint else ""), start)

    def _next(self) -> Token:
        token = self._token
        self._token = self._read(token.stop)
        return token

    def _is(self, *texts: str) -> bool:
        token = self._token
        return token.text in texts and token.kind in ("sign", "word")

    def _known(self, name: str) -> str:
        """Note a name that may hold spaces and signs, and return it without more spaces."""
        parts = _PART.findall(name)
        if len(parts) > 1:
            pattern = r"\s*".join(map(re.escape, parts))
            pattern = re.sub(r"(?<=\w)\\s\*(?=\w)", r"\\s+", pattern)
            self._names[name] = re.compile(pattern)
        return name

    # --- expressions ------------------------------------------------------------------------------

    def _expression(self) -> Node:
        self._nest()
        if self._take("if"):
            node = self._if()
        elif self._is("for", "some", "every"):
            node = self._iteration(self._next().text)
        else:
            node = self._operators()
        self._nesting -= 1
        return node

    def _if(self) -> Node:
        condition = self._expression()
        self._expect("then", "after 'if'")
        then = self._expression()
        self._expect("else", "after 'if'")
        return If(condition, then, self._expression())

    def _iteration(self, word: str) -> Node:
        known = len(self._locals)
        iterators: list[tuple[str, Node]] = []
        while not iterators or self._take(","):
            name = self._variable(f"after '{word}'")
            self._expect("in", f"after '{word}'")
            low = self._expression()
            if self._take(".."):
                low = RangeOf(low, self._expression(), True, True, descends=True)
            iterators.append((name, low))
            self._locals.append(name)
        if word == "for":
            self._locals.append("partial")
        self._expect("return" if word == "for" else "satisfies", f"after '{word}'")
        node = self._expression()
        del self._locals[known:]
        if word == "for":
            return For(tuple(iterators), node)
        for name, collection in reversed(iterators):
            node = (Some if word == "some" else Every)(name, collection, node)
        return node

    def _variable(self, why: str) -> str:
        """A name that is defined here: all up to what follows it."""
        if self._token.kind != "name":
            self._fail(f"expected a name {why}, found {self._found}")
        return self._known(self._next().text)

    def _operators(self, minimum: int = 0) -> Node:
        """The longest expression whose operators bind more strongly than `minimum`."""
        node = self._signed()
        while (strength := self._token.strength) > minimum:
            node = self._binary(node, strength)
        return node

    def _binary(self, left: Node, strength: int) -> Node:
        word = self._token.text
        if strength <= _AND:
            return self._joined(left, self._operators)
        self._next()
        if strength > _COMPARISON:
            return Arithmetic(Operation(word), left, self._operators(strength))
        if word == "in":
            node = self._tests(left)
        elif word == "between":
            low = self._operators(_COMPARISON)
            self._expect("and", "after 'between'")
            node = _within(left, RangeOf(low, self._operators(_COMPARISON), True, True))
        else:
            node = Compare(_COMPARISONS[word], left, self._operators(_COMPARISON))
        if self._is("between", "in", *_COMPARISONS):
            self._fail("comparisons do not chain; write 'a < b and b < c', or use parentheses")
        return node

    def _signed(self) -> Node:
        negative = 0
        while self._take("-"):
            negative += 1
            if negative > MAX_DEPTH:
                self._fail(f"nested deeper than {MAX_DEPTH} levels")
        node = self._value()
        if negative and isinstance(node, Literal) and _is_number(node):
            node = Literal(-node.value if negative % 2 else node.value)  # type: ignore[operator]
            negative = 0
        for _ in range(negative):
            node = Negate(node)
        return node

    # --- values -----------------------------------------------------------------------------------

    def _value(self) -> Node:
        node = self._primary()
        while True:
            if self._take("."):
                node = self._member(node)
            elif self._is("[") and not (self._in_range and _is_number(node)):
                self._next()
                self._locals.append("item")
                node = Filter(node, self._expression())
                self._locals.pop()
                self._expect("]", "to close '['")
            elif self._is("(") and not isinstance(node, Name):
                arguments, names = self._arguments()
                node = Invoke(node, arguments, names)
            elif self._take("instance"):
                if self._token.text.split()[0] != "of":
                    self._fail(f"expected 'of' after 'instance', found {self._found}")
                self._token = self._read(self._token.position + len("of"))
                node = InstanceOf(node, self._type())
            else:
                return node

    def _member(self, node: Node) -> Node:
        token = self._token
        for name in _PROPERTIES:
            pattern = re.compile(name.replace(" ", r"\s+") + r"\b")
            if found := pattern.match(self._text, token.position, self._stop):
                self._token = self._read(found.end())
                return Path(node, name)
        if token.kind not in ("name", "word"):
            self._fail(f"expected a name after '.', found {self._found}")
        self._next()
        if isinstance(node, Name) and node.name.partition(".")[0] not in self._locals:
            return Name(f"{node.name}.{token.text}")
        return Path(node, token.text)

    def _primary(self) -> Node:
        token = self._token
        match token.kind:
            case "number":
                self._next()
                if len(token.text) > _EXACT_DIGITS:  # a double has not all of them
                    return Call("FEEL number", (Literal(token.text),))
                return Literal(read_number(token.text))
            case "text":
                self._next()
                return Literal(_unescaped(token.text[1:-1]))
            case "name":
                return self._named(self._next())
            case "end":
                self._fail("expected a value, found the end")
        match token.text:
            case "true" | "false" | "null":
                self._next()
                return Literal({"true": True, "false": False}.get(token.text))
            case "function":
                return self._function()
            case "@":
                self._next()
                if self._token.kind != "text":
                    self._fail("expected a text after '@'")
                return Call("FEEL @", (Literal(_unescaped(self._next().text[1:-1])),))
            case "{":
                return self._context()
            case "[" | "]" | "(":
                return self._bracketed()
        self._fail(f"expected a value, found {self._found}")

    def _named(self, token: Token) -> Node:
        if not self._is("("):
            return Name(token.text)
        if token.text == "not":
            self._next()
            node = self._expression()
            self._expect(")", "to close 'not('")
            return Not(node)
        arguments, names = self._arguments()
        if token.text in self._locals:
            return Invoke(Name(token.text), arguments, names)
        try:
            return feel_call(token.text, arguments, names)
        except CallError as error:
            self._fail(str(error), token.position)

    def _arguments(self) -> tuple[tuple[Node, ...], tuple[str, ...]]:
        self._expect("(", "before arguments")
        arguments, names = list[Node](), list[str]()
        while not self._is(")"):
            if arguments and not self._take(","):
                break
            if len(arguments) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            if named := _NAMED.match(self._text, self._token.position, self._stop):
                names.append(re.sub(r"\s+", " ", named[1]))
                self._token = self._read(named.end())
            elif names:
                self._fail("all arguments have names, or none")
            arguments.append(self._expression())
        self._expect(")", "to close the arguments")
        if names and len(names) < len(arguments):
            self._fail("all arguments have names, or none")
        return tuple(arguments), tuple(names)

    def _function(self) -> Node:
        self._next()
        self._expect("(", "after 'function'")
        known, parameters = len(self._locals), list[str]()
        while not self._is(")"):
            if parameters:
                self._expect(",", "between parameters")
            name = self._variable("of a parameter")
            if self._take(":"):
                self._type()
            parameters.append(name)
        self._locals += parameters
        self._expect(")", "to close the parameters")
        if self._token.text == "external":
            self._fail("functions of Java or PMML are not run")
        body = self._expression()
        del self._locals[known:]
        return Lambda(tuple(parameters), body)

    def _context(self) -> Node:
        opening = self._next()
        known = len(self._locals)
        entries: list[tuple[str, Node]] = []
        while not self._is("}"):
            if entries and not self._take(","):
                break
            key = self._key()
            if key in (each for each, _ in entries):
                self._fail(f"the key {key!r} is there twice")
            entries.append((key, self._expression()))
            self._locals.append(self._known(key))
            if len(entries) > MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            self._token = self._read(self._token.position)  # with the key as a name
        self._expect("}", "to close '{'", opening)
        del self._locals[known:]
        return ContextOf(tuple(entries))

    def _key(self) -> str:
        start = self._token.position
        if self._token.kind == "text":
            key = _unescaped(self._next().text[1:-1])
            self._expect(":", "after a key")
            return key
        colon = self._text.find(":", start, self._stop)
        if colon < 0 or self._token.kind not in ("name", "word"):
            self._fail(f"expected a key, found {self._found}")
        key = re.sub(r"\s+", " ", self._text[start:colon].strip())
        if re.search(r'[\[\](){}",:]', key):
            self._fail("expected ':' after a key", start)
        self._token = self._read(colon + 1)
        return key

    def _bracketed(self) -> Node:
        """A list, a range, or an expression in parentheses."""
        opening = self._next()
        if opening.text == "(" and self._is("<", "<=", ">", ">=", "=", "!="):
            node = self._open_range()
            self._expect(")", "to close '('")
            return node
        if opening.text == "[" and self._take("]"):
            return ListOf(())
        items = [self._item(opening)]
        if self._take(".."):
            return self._to_end(items[0], opening.text == "[")
        if opening.text == "]":
            self._expect("..", "in a range")
        if opening.text == "(":
            self._expect(")", "to close '('", opening)
            return items[0]
        while self._take(","):
            if len(items) == MAX_ITEMS:
                self._fail(f"more than {MAX_ITEMS} items")
            items.append(self._item(opening))
        self._expect("]", "to close '['", opening)
        return ListOf(tuple(items))

    def _to_end(self, low: Node, included: bool) -> RangeOf:
        """The range with its high end; a [ after a number closes it."""
        outer, self._in_range = self._in_range, True
        high = self._expression()
        self._in_range = outer
        closing = self._take("]", ")", "[")
        if closing is None:
            self._fail("expected ']' or ')' to close the range")
        return RangeOf(low, high, included, closing.text == "]")

    def _item(self, opening: Token) -> Node:
        if opening.text == "[" and self._is("<", "<=", ">", ">=", "!="):
            return self._open_range()
        return self._expression()

    def _open_range(self) -> Node:
        """`< x` and the like, as a range."""
        operator = self._next().text
        value = self._operators(_COMPARISON)
        match operator:
            case "<" | "<=":
                return RangeOf(None, value, False, operator == "<=")
            case ">" | ">=":
                return RangeOf(value, None, operator == ">=", False)
            case "=":
                return RangeOf(value, value, True, True)
        return RangeOf(value, None, False, False, negated=True)

    def _tests(self, left: Node) -> Node:
        """What follows `in`: a test, or some of them in parentheses."""
        if self._is(*_COMPARISONS):
            return self._test(left)
        if not self._is("("):
            return _within(left, self._operators(_COMPARISON))
        opening = self._next()
        tests = [self._test(left, alone=False)]
        if self._take(".."):
            return _within(left, self._to_end(self._low, False))
        while self._take(","):
            tests.append(self._test(left, alone=False))
        self._expect(")", "to close '('", opening)
        if all(isinstance(each, In) and isinstance(each.container, Literal) for each in tests):
            return In(left, ListOf(tuple(each.container for each in tests)))  # type: ignore[union-attr]
        return Or(tuple(tests)) if len(tests) > 1 else tests[0]

    def _test(self, left: Node, *, alone: bool = True) -> Node:
        if self._is(*_COMPARISONS):
            operator = _COMPARISONS[self._next().text]
            return Compare(operator, left, self._operators(_COMPARISON))
        self._low = self._expression()
        return _within(left, self._low)

    # --- types ------------------------------------------------------------------------------------

    def _type(self) -> TypeName:
        for name in _TYPES:
            pattern = re.compile(name.replace(" ", r"\s+") + r"(?!\w)")
            if found := pattern.match(self._text, self._token.position, self._stop):
                self._token = self._read(found.end())
                return name, tuple(self._parts(name))
        self._fail(f"expected a type such as number or list<string>, found {self._found}")

    def _parts(self, name: str) -> Iterable[tuple[str, TypeName]]:
        parts = list[tuple[str, TypeName]]()
        if name not in ("list", "context", "range", "function") or not self._take("<"):
            return parts
        while not self._is(">"):
            if parts:
                self._expect(",", "between types")
            key = self._key() if name == "context" else ""
            parts.append((key, self._type()))
        self._expect(">", "to close the type")
        if name == "function":
            self._expect("->", "before the type of a function's values")
            parts.append(("->", self._type()))
        return parts


def _within(item: Node, container: Node) -> Node:
    """`item in container`; of a range, as comparisons, which a verifier translates."""
    if not isinstance(container, RangeOf) or container.low is None or container.high is None:
        return In(item, container)
    above = Comparison.GREATER_EQUAL if container.low_included else Comparison.GREATER
    below = Comparison.LESS_EQUAL if container.high_included else Comparison.LESS
    return And((Compare(above, item, container.low), Compare(below, item, container.high)))


def _is_number(node: Node) -> bool:
    return isinstance(node, Literal) and type(node.value) in (int, float)


def _unescaped(text: str) -> str:
    def replaced(found: re.Match[str]) -> str:
        if code := found[1] or found[2]:
            value = int(code, 16)
            return chr(value) if value <= 0x10FFFF else found[0]
        return _ESCAPED.get(found[3], found[0])

    written = _ESCAPE.sub(replaced, text)
    return written.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


__all__: Sequence[str] = ("FeelParser",)
