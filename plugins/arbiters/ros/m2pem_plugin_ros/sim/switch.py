"""Faults for vehicles that run already: as a parameter of ROS, `fault` of the node /m2pem_sim."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import TimeoutError as NoAnswerError
from typing import Any

from rcl_interfaces.msg import SetParametersResult

from m2pem_plugin_ros.sim.faults import FaultError, PlannedFault, parse

PARAMETER = "fault"
WITHIN_S = 2.0

logger = logging.getLogger(__name__)


class FaultSwitch:
    """Declares the parameter. Setting it begins the fault, or is refused with what is wrong."""

    def __init__(self, node: Any, plan: Callable[[PlannedFault], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._plan = plan
        node.declare_parameter(PARAMETER, "")
        node.add_on_set_parameters_callback(self._set)

    def _set(self, parameters: Any) -> Any:
        """Runs in the thread of ROS, and waits until the loop has done it."""
        for parameter in parameters:
            if parameter.name != PARAMETER or not parameter.value:
                continue
            done = asyncio.run_coroutine_threadsafe(self._begin(str(parameter.value)), self._loop)
            try:
                done.result(WITHIN_S)
            except FaultError as error:
                return SetParametersResult(successful=False, reason=str(error))
            except NoAnswerError:
                return SetParametersResult(successful=False, reason="the simulation is too slow")
        return SetParametersResult(successful=True)

    async def _begin(self, text: str) -> None:
        self._plan(parse(text))
        logger.info("fault: %s", text)
