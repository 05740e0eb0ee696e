"""Metrics and traces of missions: OpenTelemetry and Prometheus (docs/metrics.md)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api.face import Face


@hookimpl
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register `otlp` and `prometheus`."""
    # Starting up must be fast; and what a face needs is imported when it is made.
    from m2pem_plugin_opentelemetry.otlp import OtlpFace  # noqa: PLC0415
    from m2pem_plugin_opentelemetry.prometheus import PrometheusFace  # noqa: PLC0415

    register("otlp", OtlpFace)
    register("prometheus", PrometheusFace)
