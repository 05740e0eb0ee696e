import subprocess
import sys

from m2pem.simulation import hooks as plugin
from m2pem.simulation.arbiters import SimArbiter


def test_the_hook_registers_sim() -> None:
    registered: dict[str, object] = {}
    plugin.m2pem_register_arbiters(registered.__setitem__)
    assert registered == {"sim": SimArbiter}


def test_importing_the_hook_imports_no_simulation() -> None:
    code = "import m2pem.simulation.hooks, sys; print('m2pem.simulation.arbiters' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
