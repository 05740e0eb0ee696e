"""The table of operations, MissionControl and docs/operating.md agree."""

import re
from pathlib import Path
from typing import cast

import msgspec
import pytest

from m2pem.api.control import MissionControl
from m2pem.api.operations import OPERATIONS, Operation
from m2pem.control_socket.remote import REFUSED, RemoteControl

ROOT = Path(__file__).parents[2]
OPERATION = pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)


def methods() -> set[str]:
    parts = [each for each in MissionControl.__mro__ if each.__module__.startswith("m2pem.")]
    return {name for each in parts for name in vars(each) if not name.startswith("_")}


def test_every_method_of_mission_control_is_an_operation_or_refused() -> None:
    assert {*OPERATIONS, *REFUSED} == methods()
    assert not set(OPERATIONS) & set(REFUSED)


def test_the_remote_control_has_every_method_of_mission_control() -> None:
    assert methods() <= set(vars(RemoteControl))


def documented() -> dict[str, tuple[set[str], set[str]]]:
    """The required and the optional parameters of each operation in the docs."""
    rows = re.findall(
        r"^\| ([a-z_, ]+) \|([^|]*)\|", (ROOT / "docs" / "operating.md").read_text("utf-8"), re.M
    )
    found = {}
    for names, parameters in rows:
        required, _, optional = parameters.partition("(")[0].partition(";")
        pair = set(re.findall(r"\w+", required)), set(re.findall(r"\w+", optional))
        found.update(dict.fromkeys(names.split(", "), pair))
    return found


@OPERATION
def test_the_docs_name_an_operation_with_its_parameters(operation: Operation) -> None:
    fields = msgspec.structs.fields(operation.parameters)
    required = {each.encode_name for each in fields if each.required}
    optional = {each.encode_name for each in fields if not each.required}
    in_docs = documented()[operation.name]
    assert in_docs[0] == required
    assert optional - {"by"} <= in_docs[1] <= optional


def test_the_name_of_who_asks_has_no_control_characters() -> None:
    class Control:
        def stop_all(self, *, by: str, reason: str) -> str:
            return by

    stop = OPERATIONS["stop_all"]
    params = msgspec.convert({"by": "anna\x1b[2J\n" + 300 * "x"}, stop.parameters)
    by = stop.call(cast("MissionControl", Control()), params)
    assert by == "anna [2J " + 191 * "x"
