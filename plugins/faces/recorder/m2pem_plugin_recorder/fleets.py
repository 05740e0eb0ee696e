"""Fleets as recordings have them."""

from dataclasses import replace

from m2pem.api import Fleet
from m2pem.fleet.fleet import dump


def fleet_json(fleet: Fleet) -> bytes:
    """Return a fleet as JSON. Recordings are handed on, so addresses and passwords stay out."""
    return dump(
        replace(
            fleet,
            vehicles={key: replace(each, settings={}) for key, each in fleet.vehicles.items()},
            payloads={key: replace(each, settings={}) for key, each in fleet.payloads.items()},
            hosts={},
        )
    )
