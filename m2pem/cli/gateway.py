"""`m2pem gateway`: a fleet for programs of other protocols, without operators."""

import asyncio
from typing import Any

import click

from m2pem.cli.options import (
    example,
    face_option,
    fleet_option,
    format_option,
    journal_option,
    simulate_option,
    speed_option,
)


@click.command(epilog=example("m2pem gateway --fleet fleet.yaml --face ros,mavlink"))
@fleet_option(required=True)
@face_option
@journal_option
@simulate_option
@speed_option
@format_option
def gateway(**options: Any) -> int:
    """Show a fleet to programs of other protocols, without operators.

    Ctrl-C or SIGTERM end it. It is `m2pem serve --ocu none` that needs a face: what programs
    command through it is journaled and taken up again, and `m2pem attach`, `start` and `stop` find
    it.
    """
    from m2pem.cli.interruption import Interruption
    from m2pem.cli.serve import serve_fleet

    with Interruption() as interruption:
        return asyncio.run(serve_fleet(interruption, ocu_names="none", needs_face=True, **options))
