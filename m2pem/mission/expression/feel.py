"""Parses what FEEL alone has: its words, ranges, names with spaces (DMN 1.3, clause 10.3.1.2)."""

from m2pem.mission.expression.dialect import Dialect, Span
from m2pem.mission.expression.lexer import Token
from m2pem.mission.expression.parser import Parser
from m2pem.mission.expression.tree import (
    And,
    Call,
    Compare,
    Comparison,
    If,
    In,
    ListOf,
    Literal,
    Node,
    Not,
    Some,
)
from m2pem.mission.expression.vocabulary import COMPARISON, LOWEST


class FeelParser(Parser):
    """Reads one expression in FEEL."""

    def __init__(self, text: str, span: Span) -> None:
        super().__init__(text, span, Dialect.FEEL)

    def _prefix(self, minimum: int) -> Node:
        token = self._token
        if token.kind == "operator" and token.text in ("if", "some", "every"):
            self._next()
            return self._if(token) if token.text == "if" else self._quantified(token)
        return super()._prefix(minimum)

    def _binary(self, left: Node, strength: int) -> Node:
        if self._take("between"):
            node = self._between(left)
        elif self._take("in"):
            node = self._in(left)
        else:
            return super()._binary(left, strength)
        self._refuse_chain()
        return node

    def _not(self, token: Token, minimum: int) -> Node:
        opening = self._expect("(", "after FEEL's 'not'")
        node = self._expression(LOWEST)
        self._expect(")", "to close 'not('", opening)
        return Not(node)

    def _name(self, token: Token) -> Node:
        # Two names in a row can only be one that holds spaces.
        text = token.text
        while self._token.kind == "name":
            text += " " + self._next().text
        return super()._name(token._replace(text=text))

    def _key(self, opening: Token) -> Node:
        """FEEL counts from 1, and takes a condition for a filter."""
        match self._expression(LOWEST):
            case Literal(int(place)) if place and not isinstance(place, bool):
                return Literal(place - 1 if place > 0 else place)
        self._fail("of FEEL's filters only the number of an item is read, from 1 on", opening)

    def _if(self, token: Token) -> Node:
        condition = self._expression(LOWEST)
        self._expect("then", "after 'if'", token)
        then = self._expression(LOWEST)
        self._expect("else", "after 'if'", token)
        return If(condition, then, self._expression(LOWEST))

    def _quantified(self, token: Token) -> Node:
        variable = self._next()
        if variable.kind != "name":
            self._fail(f"expected a name after '{token.text}'", variable)
        self._expect("in", f"after '{token.text}'")
        collection = self._expression(LOWEST)
        self._expect("satisfies", f"after '{token.text}' (of one list)", token)
        condition = self._expression(LOWEST)
        if token.text == "some":
            return Some(variable.text, collection, condition)
        # Of null, FEEL's 'every' is null, which no condition takes for true.
        failing = Some(variable.text, collection, Not(condition))
        return And((Call("exists", (collection,)), Not(failing)))

    def _between(self, left: Node) -> Node:
        low = self._expression(COMPARISON)
        self._expect("and", "after 'between'")
        return self._within(left, Comparison.GREATER_EQUAL, low, self._expression(COMPARISON))

    def _within(
        self,
        item: Node,
        above: Comparison,
        low: Node,
        high: Node,
        below: Comparison = Comparison.LESS_EQUAL,
    ) -> Node:
        return And((Compare(above, item, low), Compare(below, item, high)))

    def _in(self, left: Node) -> Node:
        """`in` a list that a value gives, a written list, some values `(1, 2)`, or a range."""
        opening = self._token
        if not any(self._take(bracket) for bracket in "[(]"):
            return In(left, self._expression(COMPARISON))
        if opening.text == "[" and self._take("]"):
            return In(left, ListOf(()))
        items = [self._expression(LOWEST)]
        if self._take(".."):
            high = self._expression(LOWEST)
            closing = self._next()
            if closing.kind != "operator" or closing.text not in ("]", ")", "["):
                self._fail("expected ']' or ')' to close the range", closing)
            above = Comparison.GREATER_EQUAL if opening.text == "[" else Comparison.GREATER
            below = Comparison.LESS_EQUAL if closing.text == "]" else Comparison.LESS
            return self._within(left, above, items[0], high, below)
        if opening.text == "]":
            self._expect("..", "in a range", opening)
        if self._take(","):
            items += self._items("]" if opening.text == "[" else ")", opening)
        else:
            self._expect("]" if opening.text == "[" else ")", f"to close '{opening.text}'", opening)
        if opening.text == "(" and len(items) == 1 and not isinstance(items[0], Literal):
            return In(left, items[0])
        return In(left, ListOf(tuple(items)))
