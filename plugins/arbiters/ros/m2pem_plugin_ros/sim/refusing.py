"""A driver on board that refuses behaviors while it is told to."""

from typing import Any

from m2pem.api import BehaviorRequest
from m2pem_plugin_ros.drivers.driver import Driver
from m2pem_plugin_ros.sim.troubles import Troubles


class RefusingDriver:
    """Any driver, with one thing more that it may say to a request."""

    def __init__(self, driver: Driver, troubles: Troubles) -> None:
        self._driver, self._troubles = driver, troubles

    def __getattr__(self, name: str) -> Any:
        return getattr(self._driver, name)

    def refusal(self, request: BehaviorRequest) -> str:
        """Why it cannot be done now; "" if it can."""
        if self._troubles.refusal is not None:
            return self._troubles.refusal
        return self._driver.refusal(request)
