"""Registers the simulated arbiter, through the same hook as any other."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api.arbiter import Arbiter


@hookimpl
def m2pem_register_arbiters(register: "Callable[[str, Callable[..., Arbiter]], None]") -> None:
    """Register `sim`."""
    from m2pem.simulation.arbiters import SimArbiter  # noqa: PLC0415  # starting up must stay fast

    register("sim", SimArbiter)
