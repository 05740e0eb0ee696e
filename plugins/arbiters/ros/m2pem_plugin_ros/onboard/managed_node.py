"""A managed node of ROS (rclpy.lifecycle) whose transitions are coroutines on the event loop."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, Protocol

from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.lifecycle.node import LifecycleState

from m2pem_plugin_ros.runtime.arguments import refused

WITHIN_S = 5.0
"""A transition that takes longer has failed: the thread of ROS waits for it."""

logger = logging.getLogger("m2pem.onboard")


class TransitionRefusedError(Exception):
    """The transition is not possible now; the text says why. The state stays as it was."""


class Managed(Protocol):
    """What a managed node does. No method may wait for messages of ROS, whose thread waits for
    it."""

    async def configure(self) -> None:
        """Subscribe and publish: unconfigured -> inactive."""
        ...

    async def activate(self) -> None:
        """Obey commands from now on: inactive -> active."""
        ...

    async def deactivate(self) -> None:
        """Obey no commands from now on: active -> inactive."""
        ...

    async def cleanup(self) -> None:
        """Undo `configure`: inactive -> unconfigured."""
        ...

    async def shutdown(self) -> None:
        """Begin to end: any state -> finalized."""
        ...


class ManagedNode(LifecycleNode):  # type: ignore[misc]  # rclpy has no types
    """Before `manage`, each transition fails."""

    def __init__(self, name: str, **options: Any) -> None:
        self._managed: Managed | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self.failure: Exception | None = None
        """Why the last transition failed; None if it did not."""
        super().__init__(name, **options)
        for service in self.services:
            if service.srv_name.endswith("/change_state"):
                service.callback = partial(self._change, service.callback)

    def _change(self, change: Callable[..., Any], request: Any, response: Any) -> Any:
        """Answer a request for a transition. rclpy leaves one without an answer that there is not
        from this state."""
        try:
            return change(request, response)
        except Exception as error:  # rclpy has no base class for what it raises
            logger.warning("%s: no such transition now: %s", self.title, refused(error))
            response.success = False
            return response

    def manage(self, managed: Managed) -> None:
        """Carry transitions out with `managed`, on the running loop."""
        self._managed, self._loop = managed, asyncio.get_running_loop()

    @property
    def title(self) -> str:
        """The node as the commands of ROS name it."""
        return str(self.get_fully_qualified_name())

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._carry_out("configure")

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._carry_out("activate")

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._carry_out("deactivate")

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._carry_out("cleanup")

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        return self._carry_out("shutdown")

    def _carry_out(self, name: str) -> TransitionCallbackReturn:
        """Carry a transition out on the loop, and wait for it. It is called in the thread of
        ROS."""
        if self._managed is None or self._loop is None:
            return TransitionCallbackReturn.FAILURE
        step: Callable[[], Awaitable[None]] = getattr(self._managed, name)
        done = asyncio.run_coroutine_threadsafe(_awaited(step), self._loop)
        self.failure = None
        try:
            done.result(WITHIN_S)
        except TransitionRefusedError as refusal:
            self.failure = refusal
            logger.warning("%s: %s is refused: %s", self.title, name, refusal)
        except TimeoutError as error:
            done.cancel()
            self.failure = error
            logger.error("%s: %s took longer than %g s", self.title, name, WITHIN_S)
        except Exception as error:
            self.failure = error
            logger.error("%s: %s failed: %s", self.title, name, error, exc_info=error)
        else:
            logger.info("%s: %s", self.title, name)
            return TransitionCallbackReturn.SUCCESS
        return TransitionCallbackReturn.FAILURE


async def _awaited(step: Callable[[], Awaitable[None]]) -> None:
    await step()
