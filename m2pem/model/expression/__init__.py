"""The expression language of conditions, parameters and assignments (docs/conditions.md).

`parse` reads one of three dialects (bare, Camunda 7 `${...}`, FEEL) to one syntax tree, which is
compiled to closures. There is no way out of it: no attribute access on objects, no calls but the
listed functions, bounded length, depth and number size.
"""

from m2pem.model.values import ReadValue, Value


class Expression:
    """A parsed expression; never changes."""

    text: str
    names: frozenset[str]

    def evaluate(self, read: ReadValue) -> Value:
        """Its value over the data store; raises ExpressionError."""
        raise NotImplementedError

    def holds(self, read: ReadValue) -> bool:
        """Its truth: null is false; anything but a boolean raises ExpressionError."""
        raise NotImplementedError


def parse(text: str, language: str | None = None) -> Expression:
    """Parse an expression; raises ExpressionSyntaxError."""
    raise NotImplementedError


def template(text: str) -> Expression:
    """Parse an expression (`${...}`, leading `=`); any other text is a literal."""
    raise NotImplementedError
