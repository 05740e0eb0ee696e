"""Reads a YAML 1.2 file that a person wrote, keeping lines, and names what is wrong in it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args, get_origin

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from m2pem.findings import Finding, Severity, unreadable_remedy
from m2pem.mission.values import MAX_DEPTH, Value
from m2pem.suggestions import did_you_mean, suggest

if TYPE_CHECKING:  # a spec file of requirements needs no pydantic
    from pydantic import BaseModel, ValidationError

MAX_BYTES = 2_000_000
MAX_VALUES = 200_000

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys and list indices from the root of the file to a value."""

_TAG = "tag:yaml.org,2002:"
_KINDS = frozenset({"map", "seq", "str", "null", "bool", "int", "float", "timestamp"})
_INT_LIMIT = 2**63


def dotted(path: KeyPath) -> str:
    """How findings name a place: `vehicles.evsg1.behaviors[2]`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


@dataclass(slots=True)
class YamlSource:
    """A file as read: `data` (None when it could not be), and where its keys stand."""

    file: str
    data: Value = None
    lines: dict[KeyPath, int] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    def line(self, path: KeyPath) -> int:
        """The line of the value at `path`, or of the nearest one that contains it; 0 if none."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.lines:
                return self.lines[path[:length]]
        return 0

    def error(self, path: KeyPath, rule: str, message: str, remedy: str = "") -> None:
        """Note an error at the value of `path`."""
        self._note(self.line(path), path, rule, message, remedy)

    def _note(self, line: int, path: KeyPath, rule: str, message: str, remedy: str = "") -> None:
        self.findings.append(
            Finding(Severity.ERROR, self.file, line, dotted(path), rule, message, remedy)
        )

    def mapping(self, *path: str) -> Mapping[str, Any]:
        """The map at `path`, or an empty one when there is none."""
        value: Any = self.data
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        return value if isinstance(value, dict) else {}


def read_yaml(path: Path) -> YamlSource:
    """Read a file; whatever is wrong with it is in `findings`, all of it."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        source = YamlSource(str(path))
        reason = f"cannot be read: {error.strerror}"
        source.error((), "unreadable", reason, unreadable_remedy(error))
        return source
    return parse_yaml(content, str(path))


def parse_yaml(content: bytes, name: str) -> YamlSource:
    """As `read_yaml`, for text from elsewhere; `name` is what findings call it."""
    source = YamlSource(name)
    if len(content) > MAX_BYTES:
        source.error((), "too-large", f"is larger than {MAX_BYTES:,} bytes")
        return source
    yaml = YAML(typ="safe", pure=True)
    try:
        root = yaml.compose(content.decode("utf-8"))
        if root is not None:
            source.data = _Reader(source, yaml).value(root, ())
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        source._note(line, (), "not-utf-8", "is not UTF-8 text")
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 0
        problem = " ".join((error.problem or error.context or "syntax error").split())
        source._note(line, (), "yaml-syntax", f"is not YAML: {problem}")
    except YAMLError as error:
        source._note(0, (), "yaml-syntax", f"is not YAML: {' '.join(str(error).split())}")
    except (_TooMuchError, RecursionError) as error:
        source.data = None
        reason = str(error) if isinstance(error, _TooMuchError) else "is nested too deep"
        source._note(0, (), "too-large", reason)
    return source


def _no_text(node: MappingNode, key_node: Node) -> tuple[str, str]:
    """Message and remedy for a key that is no text.

    A number in a flow map, as in {lat: 53,5400}, is what follows a decimal comma.
    """
    if not isinstance(key_node, ScalarNode):
        return "this key is not a text", "keys are texts: quote it"
    text = str(key_node.value)
    previous = ""
    for key, value in node.value:
        if key is key_node and node.flow_style and text.isdecimal():
            if previous.removeprefix("-").isdecimal():
                return (
                    f"the comma splits the number {previous},{text} in two",
                    f"write a decimal point: {previous}.{text}",
                )
            break
        previous = str(value.value)
    return f"{text} is not a text", "keys are texts: quote it"


class _TooMuchError(Exception):
    pass


@dataclass(slots=True)
class _Reader:
    """Turns YAML nodes into values, counting what aliases multiply."""

    source: YamlSource
    yaml: YAML
    count: int = 0

    def value(self, node: Node, path: KeyPath) -> Value:
        self.count += 1
        if self.count > MAX_VALUES:
            raise _TooMuchError(f"holds more than {MAX_VALUES:,} values once aliases are followed")
        if len(path) > MAX_DEPTH:
            raise _TooMuchError(f"is nested deeper than {MAX_DEPTH} levels")
        line = node.start_mark.line + 1
        self.source.lines.setdefault(path, line)
        if str(node.tag).removeprefix(_TAG) not in _KINDS:
            self.source._note(
                line, path, "yaml-tag", f"the tag {node.tag} is not allowed", "remove it"
            )
            return None
        if isinstance(node, MappingNode):
            return self._mapping(node, path)
        if isinstance(node, SequenceNode):
            return [self.value(item, (*path, index)) for index, item in enumerate(node.value)]
        return self._scalar(node, path)

    def _mapping(self, node: MappingNode, path: KeyPath) -> Value:
        result: dict[str, Value] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            key = self._scalar(key_node, path) if isinstance(key_node, ScalarNode) else None
            if isinstance(key_node, ScalarNode) and key_node.value == "<<":
                self.source._note(
                    line, path, "merge-key", "'<<' is not YAML 1.2", "write the keys out"
                )
            elif not isinstance(key, str):
                self.source._note(line, path, "key-not-text", *_no_text(node, key_node))
            elif key in result:
                first = self.source.line((*path, key))
                self.source._note(
                    line,
                    (*path, key),
                    "duplicate-key",
                    f"'{key}' stands twice in one map (first in line {first})",
                    "remove or rename one",
                )
            else:
                self.source.lines[*path, key] = line
                result[key] = self.value(value_node, (*path, key))
        return result

    def _scalar(self, node: Node, path: KeyPath) -> Value:
        line = node.start_mark.line + 1
        text = str(node.value)
        kind = str(node.tag).removeprefix(_TAG)
        if kind not in ("null", "bool", "int", "float"):
            return text
        try:
            value: Value = self.yaml.constructor.construct_object(node)
        except (ValueError, LookupError):  # a tag that its text does not fit: "!!int abc"
            self.source._note(line, path, "yaml-tag", f"{text!r} is not of type {kind}")
            return None
        too_large = isinstance(value, int) and not -_INT_LIMIT <= value < _INT_LIMIT
        if too_large or (isinstance(value, float) and not math.isfinite(value)):
            self.source._note(line, path, "number", f"{text} is not a finite 64-bit number")
            return None
        return value


_EXPECTED = {
    "model_type": "is not a map",
    "dict_type": "is not a map",
    "list_type": "is not a list",
    "string_type": "is not a text",
    "float_type": "is not a number",
    "bool_type": "is neither true nor false",
    "too_short": "is too short",
    "string_too_short": "is empty",
}
_REMEDY = {
    "model_type": "write 'key: value' lines below it",
    "dict_type": "write 'key: value' lines below it",
    "list_type": "write it in [ ]",
    "string_type": "write a text (a number or true is one in quotes)",
    "bool_type": "YAML 1.2 reads only true and false as such",
    "too_short": "at least one is needed",
}


def note_shape_findings(
    source: YamlSource, error: "ValidationError", root: "type[BaseModel]"
) -> None:
    """Add a finding to `source` for everything in `error`; `root` is the model of the file."""
    for detail in error.errors():
        path: KeyPath = tuple(part for part in detail["loc"] if part != "[key]")
        _note(source, detail["type"], path, detail, root)


def _note(
    source: YamlSource, kind: str, path: KeyPath, detail: Mapping[str, Any], root: "type[BaseModel]"
) -> None:
    last = str(path[-1]) if path else ""
    if kind == "extra_forbidden":
        known = _model_at(root, path[:-1]).model_fields
        source.error(path, "unknown-key", f"unknown key '{last}'", suggest(last, known, "keys"))
    elif kind == "missing":
        source.error(path, "missing-key", f"'{last}' is missing")
    elif kind == "literal_error":
        expected = str(detail["ctx"]["expected"])
        message = f"{detail['input']!r} is not one of {expected}"
        choices = [choice.strip("'") for choice in expected.replace(" or ", ", ").split(", ")]
        source.error(path, "bad-value", message, did_you_mean(str(detail["input"]), choices))
    elif kind == "string_pattern_mismatch":
        message = f"{detail['input']!r} is no name: it has white space or '/' in it, or is empty"
        source.error(path, "bad-name", message)
    elif kind == "value_error":
        source.error(path, "bad-value", str(detail["ctx"]["error"]))
    else:
        message = _EXPECTED.get(kind) or detail["msg"].removeprefix("Input ")
        shown = repr(detail["input"])
        shown = shown if len(shown) <= 60 else f"{shown[:57]}..."
        source.error(path, "bad-value", f"{shown} {message}", _REMEDY.get(kind, ""))


def _model_at(model: "type[BaseModel]", path: KeyPath) -> "type[BaseModel]":
    """The model of the map at `path` below one of `model`."""
    here: Any = model
    for part in path:
        if _is_model(here):
            here = _unwrapped(here.model_fields[str(part)].annotation)
        elif get_origin(here) in (dict, list):
            here = _unwrapped(get_args(here)[-1])
    return here if _is_model(here) else model


def _is_model(here: Any) -> bool:
    return isinstance(here, type) and hasattr(here, "model_fields")


def _unwrapped(annotation: Any) -> Any:
    """`annotation` without validators and without an "or None"."""
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is UnionType or isinstance(annotation, UnionType):
        return next(arg for arg in get_args(annotation) if arg is not type(None))
    return annotation
