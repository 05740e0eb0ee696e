"""What words and symbols mean in each dialect. The operators of all get one name each here."""

from m2pem.mission.expression.dialect import Dialect

LOWEST, OR, AND, NOT, EQUALITY, COMPARISON, SUM, PRODUCT, UNARY = range(9)
_BINARY = {
    "or": OR,
    "and": AND,
    **dict.fromkeys(("in", "not"), COMPARISON),
    **dict.fromkeys(("==", "!=", "<", "<=", ">", ">="), COMPARISON),
    **dict.fromkeys("+-", SUM),
    **dict.fromkeys("*/%", PRODUCT),
}
"""How strongly an operator binds after a value; `not` there begins `not in`."""

COERCING = frozenset({Dialect.JUEL, Dialect.XPATH})
"""Languages that coerce values; comparisons chain there, `==` and `!=` bind more weakly."""

CONSTANTS = {"true": True, "false": False, "null": None}
_SYMBOLS = {
    s: s for s in ("!=", "<=", ">=", "<", ">", "+", "-", "*", "/", "(", ")", "[", "]", ",", ".")
}
_TERNARY = {"?": "?", ":": ":"}
_COMPARING = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_DIVIDING = {"div": "/", "mod": "%"}
_WORDS = {"and": "and", "or": "or", "not": "not", "in": "in"}

SYMBOLS = {
    Dialect.BARE: {**_SYMBOLS, **_TERNARY, "==": "=="},
    Dialect.JUEL: {
        **_SYMBOLS,
        **_TERNARY,
        "==": "==",
        "&&": "and",
        "||": "or",
        "!": "not",
        "%": "%",
    },
    Dialect.XPATH: {s: s for s in _SYMBOLS if s not in "/[]."} | {"=": "=="},
}
WORDS = {
    Dialect.BARE: _WORDS,
    Dialect.JUEL: {
        **_WORDS,
        **_COMPARING,
        **_DIVIDING,
        "empty": "empty",
    },
    Dialect.XPATH: {"and": "and", "or": "or", **_DIVIDING},
}


def _meanings(dialect: Dialect) -> dict[str, tuple[str, str, int]]:
    """The kind, text and strength of what is written, where it has a meaning of its own."""
    operators = {**SYMBOLS[dialect], **WORDS[dialect]}
    equality = dict.fromkeys(("==", "!="), EQUALITY) if dialect in COERCING else {}
    binary = {**_BINARY, **equality}
    return {
        **{w: (name, name, binary.get(name, LOWEST)) for w, name in operators.items()},
        **{word: ("constant", word, LOWEST) for word in CONSTANTS},
    }


MEANINGS = {dialect: _meanings(dialect) for dialect in SYMBOLS}


def is_reserved(name: str, dialect: Dialect) -> bool:
    """Whether a name can never be read because the dialect gives it a meaning."""
    return name in MEANINGS[dialect]
