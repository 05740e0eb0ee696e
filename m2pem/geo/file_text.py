"""The text and the JSON of files that people give."""

import json
from typing import Any, NoReturn

from m2pem.geo.geojson import GeometryError


def decoded(content: bytes) -> str:
    """Return the text of a file in UTF-8, with or without a byte order mark.

    Raises:
        GeometryError: it is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise GeometryError("is not UTF-8 text") from None


def parsed_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises:
        GeometryError: it is not JSON, holds NaN or Infinity, or is nested too deep.
    """
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise GeometryError(f"line {error.lineno}: is not JSON: {error.msg}") from None
    except RecursionError:
        raise GeometryError("is nested too deep") from None
    except GeometryError:
        raise
    except ValueError as error:  # a whole number of thousands of digits
        raise GeometryError(f"is not JSON: {error}") from None


def _refuse_constant(name: str) -> NoReturn:
    raise GeometryError(f"holds {name}, which is not a finite number")
