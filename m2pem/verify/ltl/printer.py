"""Formulas as people write them; reading the text gives the same formula."""

from m2pem.verify.ltl.formula import (
    OPERATORS,
    PREFIXES,
    Active,
    Always,
    And,
    Commanded,
    Completed,
    Constant,
    Count,
    Data,
    Ended,
    Eventually,
    Formula,
    Historically,
    Iff,
    Implies,
    Next,
    Not,
    Once,
    Or,
)

_LOOSE, _IFF, _IMPLIES, _OR, _AND, _UNTIL, _UNARY = range(7)

_BINARY: dict[type[Formula], tuple[str, int]] = {
    Iff: ("<->", _IFF),
    Implies: ("->", _IMPLIES),
    **{kind: (word, _UNTIL) for kind, word in OPERATORS.items()},
}


def show(formula: Formula) -> str:
    """The formula as text."""
    return _show(formula, _LOOSE)


def _show(formula: Formula, around: int) -> str:
    """`around`: how strongly what is around binds; a weaker formula gets parentheses."""
    match formula:
        case Active():
            return f"active({_name(formula.element)})"
        case Completed():
            return f"completed({_name(formula.element)})"
        case Commanded():
            behavior = f", {_name(formula.behavior)}" if formula.behavior else ""
            return f"commanded({_name(formula.resource)}{behavior})"
        case Ended():
            return f"ended({formula.outcome})" if formula.outcome else "ended"
        case Data():
            return f"({formula.expression.text.strip()})" if around else formula.expression.text
        case Constant():
            return "true" if formula.value else "false"
        case Count():
            inside = ", ".join(show(each) for each in formula.operands)
            text = f"count({inside}) {formula.operator} {formula.number}"
            return f"({text})" if around >= _UNTIL else text
        case Once():
            return f"once({show(formula.operand)})"
        case Historically():
            return f"historically({show(formula.operand)})"
        case Not() | Always() | Eventually():
            return PREFIXES[type(formula)] + _show(formula.operand, _UNARY)
        case Next():
            return f"X {_show(formula.operand, _UNARY)}"
        case And():
            return _joined(" && ", formula.operands, _AND, around)
        case Or():
            return _joined(" || ", formula.operands, _OR, around)
        case _:
            word, strength = _BINARY[type(formula)]
            text = (
                f"{_show(formula.left, strength + 1)} {word} {_show(formula.right, strength + 1)}"
            )
            return f"({text})" if around > strength or around == _UNARY else text


def _joined(word: str, operands: tuple[Formula, ...], strength: int, around: int) -> str:
    text = word.join(_show(each, strength + 1) for each in operands)
    return f"({text})" if around > strength else text


def _name(name: str) -> str:
    plain = name and all(c.isalnum() or c in "_-.:/" for c in name)
    return name if plain else "'" + name.replace("'", "\\'") + "'"
