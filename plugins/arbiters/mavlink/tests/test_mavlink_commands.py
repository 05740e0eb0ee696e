import subprocess
import sys

CODE = """
import sys
from m2pem.cli.group import run_command_line
assert run_command_line(["sim", "--help"]) == 0
heavy = ("asyncio", "pymavlink", "m2pem_plugin_mavlink.simulator")
print(*(name for name in heavy if name in sys.modules))
"""


def printed(code: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_the_list_of_simulators_loads_none_of_them() -> None:
    lines = printed(CODE)
    assert any("mavlink" in line and "Simulate MAVLink vehicles over UDP" in line for line in lines)
    assert lines[-1] == ""


def test_the_command_itself_has_its_options() -> None:
    words = ["sim", "mavlink", "--help"]
    code = f"from m2pem.cli.group import run_command_line\nrun_command_line({words!r})"
    assert any("--copters" in line for line in printed(code))
