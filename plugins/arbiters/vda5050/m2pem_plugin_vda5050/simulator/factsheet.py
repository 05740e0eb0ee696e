"""The factsheet of a simulated vehicle (section 6.15)."""

from typing import Any

import msgspec

from m2pem_plugin_vda5050.catalogue import DRIVING_PARAMETERS, PREDEFINED, required_parameters
from m2pem_plugin_vda5050.simulator.agv import INSTANT_ACTIONS, AgvSpec

_NUMBERS = ("x", "y", "theta", "height", "depth")


def factsheet(spec: AgvSpec, header: dict[str, Any]) -> bytes:
    """Return the message. `header`: its header, by the names of Python."""
    names = {"header_id": "headerId", "serial_number": "serialNumber"}
    body = {names.get(key, key): value for key, value in header.items()}
    body |= {
        "typeSpecification": {
            "seriesName": "m2pem simulated vehicle",
            "agvKinematic": "DIFF",
            "agvClass": "CARRIER",
            "maxLoadMass": 500.0,
            "localizationTypes": ["NATURAL"],
            "navigationTypes": ["AUTONOMOUS"],
        },
        "physicalParameters": {
            "speedMin": 0.05,
            "speedMax": spec.chassis.speed_m_s,
            "accelerationMax": spec.chassis.acceleration_m_s2,
            "decelerationMax": spec.chassis.acceleration_m_s2,
            "heightMin": 0.4,
            "heightMax": 0.4,
            "width": 0.6,
            "length": 0.9,
        },
        "protocolLimits": {
            "maxStringLens": {"idLen": 64},
            "maxArrayLens": {"order.nodes": 1000, "order.edges": 999},
            "timing": {"minOrderInterval": 0.1, "minStateInterval": 0.05},
        },
        "protocolFeatures": {
            "optionalParameters": [
                {"parameter": f"order.{name}", "support": "SUPPORTED"}
                for name in (
                    "nodes.nodePosition.theta",
                    "nodes.nodePosition.allowedDeviationXY",
                    "edges.maxSpeed",
                    "edges.orientation",
                )
            ],
            "agvActions": [
                *(_action(name, ["NODE"]) for name in spec.actions),
                *(_action(name, ["INSTANT"]) for name in INSTANT_ACTIONS),
            ],
        },
        "agvGeometry": {},
        "loadSpecification": {"loadPositions": ["top"]},
    }
    return msgspec.json.encode(body)


def _action(name: str, scopes: list[str]) -> dict[str, Any]:
    required = required_parameters(name, None)
    parameters = [
        {
            "key": key,
            "valueDataType": "NUMBER" if key in _NUMBERS else "STRING",
            "isOptional": key not in required,
        }
        for key in PREDEFINED.get(name, {}).get("parameters", {})
        if key not in DRIVING_PARAMETERS
    ]
    return {"actionType": name, "actionScopes": scopes, "actionParameters": parameters}
