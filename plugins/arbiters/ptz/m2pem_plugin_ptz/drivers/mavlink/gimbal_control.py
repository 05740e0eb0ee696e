"""Being in control of a gimbal: its manager obeys who is, and there may be other stations."""

import asyncio

from m2pem_plugin_mavlink import Address, ExchangeError, gimbal

from m2pem_plugin_ptz.drivers.mavlink.post import Post

RELEASE_WITHIN_S = 1.0
"""Of real time: nobody waits longer for a gimbal to be left to others."""

NOBODY = 0


class GimbalControl:
    """Control is taken when it is needed, from nobody. `device`: of the manager's gimbals."""

    def __init__(self, post: Post, manager: Address, device: int) -> None:
        self._post = post
        self._manager, self._device = manager, device
        self._own = Address(post.settings.gcs_system_id, post.settings.own_component)
        self._ours = False
        self._other: Address | None = None
        self._taking: asyncio.Task[None] | None = None

    @property
    def refusal(self) -> str:
        """Why the gimbal is not to be moved; "" if it may be."""
        if self._other is None:
            return ""
        system, component = self._other
        return (
            f"another ground station (system {system}, component {component}) controls the gimbal, "
            "and must release it first"
        )

    def told(self, controller: Address | None) -> None:
        """The manager has said who is in control."""
        if controller is None:
            return
        before = self._other
        is_other = controller.system != NOBODY and controller != self._own
        self._other = controller if is_other else None
        if controller != self._own:
            self._ours = False
        if self._other is not None and self._other != before:
            self._post.logger.warning("%s: %s", self._post.resource, self.refusal)

    async def take(self) -> None:
        """Be in control; whoever else is asking meanwhile waits for the same answer.

        Raises:
            ExchangeError: the manager refuses, or does not answer.
        """
        if self._ours:
            return
        if self._taking is None or self._taking.done():
            self._taking = asyncio.get_running_loop().create_task(self._take())
            # Whoever asked may be gone by now, with another order.
            self._taking.add_done_callback(lambda done: done.cancelled() or done.exception())
        await asyncio.shield(self._taking)

    async def _take(self) -> None:
        command = gimbal.take_control(self._manager, self._own, self._device)
        await self._post.link.perform(command)
        self._ours = True

    async def close(self) -> None:
        """Leave the gimbal to others."""
        if self._taking is not None:
            self._taking.cancel()
            await asyncio.gather(self._taking, return_exceptions=True)
        if self._ours:
            try:
                async with asyncio.timeout(RELEASE_WITHIN_S):
                    await self._post.link.perform(gimbal.release(self._manager, self._device))
            except (ExchangeError, TimeoutError) as error:
                self._post.logger.debug("%s: not released: %s", self._post.resource, error)
