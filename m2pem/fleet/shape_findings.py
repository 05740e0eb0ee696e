"""Says in a person's words what pydantic found wrong with the shape of a YAML file."""

from collections.abc import Mapping
from types import UnionType
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from m2pem.fleet.yaml_source import KeyPath, YamlSource
from m2pem.suggestions import did_you_mean, suggest

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


def note_shape_findings(source: YamlSource, error: ValidationError, root: type[BaseModel]) -> None:
    """Add a finding to `source` for everything in `error`; `root` is the model of the file."""
    for detail in error.errors():
        path: KeyPath = tuple(part for part in detail["loc"] if part != "[key]")
        _note(source, detail["type"], path, detail, root)


def _note(
    source: YamlSource, kind: str, path: KeyPath, detail: Mapping[str, Any], root: type[BaseModel]
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


def _model_at(model: type[BaseModel], path: KeyPath) -> type[BaseModel]:
    """The model of the map at `path` below one of `model`."""
    here: Any = model
    for part in path:
        if isinstance(here, type) and issubclass(here, BaseModel):
            here = _unwrapped(here.model_fields[str(part)].annotation)
        elif get_origin(here) in (dict, list):
            here = _unwrapped(get_args(here)[-1])
    return here if isinstance(here, type) and issubclass(here, BaseModel) else model


def _unwrapped(annotation: Any) -> Any:
    """`annotation` without an "or None"."""
    if get_origin(annotation) is UnionType or isinstance(annotation, UnionType):
        return next(arg for arg in get_args(annotation) if arg is not type(None))
    return annotation
