"""Payloads in the vehicles pane."""

import math
from typing import Any

import pytest
from m2pem_plugin_terminal.vehicles_pane import payload_text

from m2pem.api.telemetry import LinkState, PayloadState
from m2pem.mission.catalogue import ResourceId


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({}, ""),
        ({"behavior": "b1"}, "ptz: track"),
        ({"pan_rad": 0.0, "tilt_rad": 0.0, "zoom": 1.0}, ""),
        ({"pan_rad": 0.0, "tilt_rad": 0.0, "zoom": 1.0, "behavior": "b1"}, "ptz: track"),
        ({"pan_rad": math.radians(30)}, "ptz: 30°→"),
        ({"pan_rad": math.radians(-170)}, "ptz: 170°←"),
        ({"pan_rad": math.radians(370)}, "ptz: 10°→"),
        ({"pan_rad": 0.0, "tilt_rad": math.radians(12)}, "ptz: 12°↑"),
        (
            {"pan_rad": 0.5, "tilt_rad": -0.25, "zoom": 4.0, "behavior": "b1"},
            "ptz: 29°→ 14°↓ x4 track",
        ),
        ({"link": LinkState.LOST, "behavior": "b1", "pan_rad": 0.5}, "ptz: no telemetry"),
        ({"pan_rad": math.nan, "tilt_rad": math.inf}, ""),
    ],
)
def test_where_it_looks_is_told_if_that_matters(said: dict[str, Any], words: str) -> None:
    state = PayloadState(ResourceId("evsg2/ptz"), 0, **said)
    assert payload_text(state, lambda _: "track") == words
