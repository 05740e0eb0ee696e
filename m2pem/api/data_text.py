"""Data as operators type it: `name=value`, the value in YAML 1.2."""

from m2pem.errors import OperatorError
from m2pem.fleet.yaml_source import parse_yaml
from m2pem.mission.values import Value


def named_value(text: str) -> tuple[str, Value]:
    """Read "name=value".

    Raises:
        OperatorError: it is not of that form, or the value is no YAML.
    """
    name, equals, value = text.partition("=")
    name = name.strip()
    if not (name and equals):
        raise OperatorError(f"{text!r} is not of the form NAME=VALUE")
    return name, value_of(value, name)


def value_of(text: str, name: str) -> Value:
    """Read the value of `name`.

    Raises:
        OperatorError: it is no YAML.
    """
    source = parse_yaml(text.encode("utf-8", "replace"), name)
    if source.findings:
        raise OperatorError(f"the value of {name}: {source.findings[0].message}")
    value: Value = source.data
    return value
