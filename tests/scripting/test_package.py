"""`import m2pem` is light, has every public name, and its functions outlive imports of modules."""

import subprocess
import sys

import pytest

import m2pem


def run(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, text=True
    )
    return done.stdout


def test_import_m2pem_loads_no_parser_and_no_asyncio() -> None:
    heavy = "asyncio", "pydantic", "lxml", "msgspec", "m2pem.bpmn", "m2pem.scripting.executive"
    loaded = run(f"import sys, m2pem\nprint([each for each in {heavy!r} if each in sys.modules])")
    assert loaded.strip() == "[]"


def test_all_names_are_there() -> None:
    assert set(m2pem.__all__) <= set(dir(m2pem))
    for name in m2pem.__all__:
        assert getattr(m2pem, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = m2pem.nothing


@pytest.mark.parametrize(
    "first", ["import m2pem.verify.check", "from m2pem.verify.check import check", "m2pem.verify"]
)
def test_verify_is_the_function_whatever_was_imported_before(first: str) -> None:
    code = f"import m2pem\n{first}\nfrom m2pem import verify\n"
    code += "from m2pem.verify import check as module\n"
    code += "print(callable(m2pem.verify), m2pem.verify is verify, module.__name__)"
    assert run(code).split() == ["True", "True", "m2pem.verify.check"]
