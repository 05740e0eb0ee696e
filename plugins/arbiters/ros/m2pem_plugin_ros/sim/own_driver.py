"""The driver on board of a simulated vehicle: it drives the base, or refuses to."""

from dataclasses import replace
from typing import Any

from m2pem.api import BehaviorRequest
from m2pem_plugin_ros.drivers.driver import Driver, Health
from m2pem_plugin_ros.sim.battery import Battery
from m2pem_plugin_ros.sim.troubles import Troubles


class OwnDriver:
    """Any driver; it also knows of the vehicle's battery."""

    def __init__(self, driver: Driver, battery: Battery, troubles: Troubles) -> None:
        self._driver, self._battery, self._troubles = driver, battery, troubles

    def __getattr__(self, name: str) -> Any:
        return getattr(self._driver, name)

    @property
    def health(self) -> Health:
        """What is known by now."""
        return replace(self._driver.health, battery_fraction=self._battery.fraction)

    def refusal(self, request: BehaviorRequest) -> str:
        """Why it cannot be done now; "" if it can."""
        if self._troubles.refusal is not None:
            return self._troubles.refusal
        return self._driver.refusal(request)
