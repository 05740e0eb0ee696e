"""A camera that speaks ONVIF (Profiles S and T; G for the video that it keeps)."""

import asyncio
import contextlib
import math

from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.driver import CameraError, Seat
from m2pem_plugin_ptz.drivers.onvif.capabilities import Abilities, read_abilities
from m2pem_plugin_ptz.drivers.onvif.media import (
    Recording,
    fetch_snapshot,
    start_recording,
    stop_recording,
)
from m2pem_plugin_ptz.drivers.onvif.mover import Mover
from m2pem_plugin_ptz.drivers.onvif.session import (
    RefusedError,
    Session,
    UnauthorizedError,
    camera,
    require,
)
from m2pem_plugin_ptz.drivers.onvif.settings import Credentials, read_credentials, read_onvif
from m2pem_plugin_ptz.gimbal import Look, Picture, Reach

FIRST_RETRY_S = 0.5
LONGEST_RETRY_S = 5.0
REFUSED_RETRY_S = 60.0
"""Cameras lock users out who come too often with a wrong password."""

LOOK_AT_FILE_S = 0.5
"""A password that was corrected is tried at once."""


class OnvifDriver:
    """Implements `CameraDriver`. What a fleet may say of it: docs/ptz.md.

    Raises:
        PluginError: a setting cannot be used; the text names the resource and the key.
    """

    def __init__(self, seat: Seat) -> None:
        self._settings = read_onvif(seat.connection.resource, seat.settings.own)
        self._name = f"{seat.connection.resource}: {camera(self._settings)}"
        self._fleet_reach = seat.settings.reach
        self._clock, self._logger = seat.context.clock, seat.context.logger
        self._mover = Mover(self._clock, self._logger, seat.heard, camera(self._settings))
        self._session: Session | None = None
        self._abilities: Abilities | None = None
        self._recording: Recording | None = None
        self._trouble = f"{camera(self._settings)} has not answered yet"
        self._logged = ""
        self._doubted_us = -math.inf
        self._task: asyncio.Task[None] | None = None

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """See `CameraDriver`."""
        await asyncio.to_thread(require)
        credentials = self._credentials()
        self._task = asyncio.get_running_loop().create_task(self._live(credentials))

    async def close(self) -> None:
        """See `CameraDriver`."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    def _credentials(self) -> Credentials | None:
        path = self._settings.credentials
        return None if path is None else read_credentials(path)

    async def _live(self, credentials: Credentials | None) -> None:
        retry_s = FIRST_RETRY_S
        while True:
            try:
                session = Session(self._settings, credentials)
                try:
                    await self._talk(session)
                finally:
                    self._session = None
                    await session.close()
            except UnauthorizedError as error:
                if self._may_be_the_clock():
                    continue
                self._say(error.reason)
                await self._until_file_changes(REFUSED_RETRY_S)
            except CameraError as error:
                if not self._trouble:
                    retry_s = FIRST_RETRY_S
                self._say(error.reason)
                await self._clock.sleep(retry_s)
                retry_s = min(2 * retry_s, LONGEST_RETRY_S)
            except Exception as error:
                # A camera's strange answer must not end its driver for ever.
                self._logger.exception("%s", self._name)
                self._say(f"{self._name}: {type(error).__name__}: {error}")
                await self._clock.sleep(LONGEST_RETRY_S)
            try:
                credentials = self._credentials()
            except PluginError as error:
                self._say(str(error))
                await self._until_file_changes(LONGEST_RETRY_S)

    def _may_be_the_clock(self) -> bool:
        """The password was right a moment ago: the camera's clock may have been set."""
        now_us = self._clock.now_us()
        if not self._mover.answered or now_us - self._doubted_us < REFUSED_RETRY_S * 1e6:
            return False
        self._doubted_us = now_us
        return True

    async def _talk(self, session: Session) -> None:
        await session.open()
        self._abilities = await read_abilities(session, self._fleet_reach)
        self._session = session
        if self._logged:
            self._logger.info("%s answers", self._name)
        self._trouble = self._logged = ""
        await self._mover.run(session, self._abilities)

    def _say(self, trouble: str) -> None:
        self._trouble = trouble
        if self._logged != trouble:
            self._logger.warning("%s", trouble)
        self._logged = trouble

    async def _until_file_changes(self, seconds: float) -> None:
        before = self._file_stamp()
        until_us = self._clock.now_us() + int(seconds * 1e6)
        while self._clock.now_us() < until_us and self._file_stamp() == before:
            await self._clock.sleep(LOOK_AT_FILE_S)

    def _file_stamp(self) -> tuple[int, int, int]:
        path = self._settings.credentials
        try:
            said = path.stat() if path is not None else None
        except OSError:
            said = None
        return (said.st_mtime_ns, said.st_ctime_ns, said.st_ino) if said is not None else (0, 0, 0)

    # --- what is known --------------------------------------------------------------------------

    @property
    def look(self) -> Look | None:
        """See `CameraDriver`."""
        return self._mover.look

    @property
    def reach(self) -> Reach:
        """See `CameraDriver`; until the camera has said more, what the fleet says."""
        spaces = self._abilities.spaces if self._abilities is not None else None
        return self._fleet_reach if spaces is None else spaces.reach

    def refusal(self, behavior: str) -> str:
        """See `CameraDriver`."""
        abilities = self._abilities
        if self._trouble or abilities is None:
            return self._trouble
        who = camera(self._settings)
        if not self._mover.says_position:
            return f"{who} does not say where it looks (GetStatus without a known position)"
        if behavior == "take_picture":
            return abilities.no_snapshot
        if behavior == "record_video":
            return "" if abilities.records else f"{who} cannot be told to record (ONVIF Profile G)"
        spaces = abilities.spaces
        if spaces is None:
            return (
                f"{who} does not turn: its profile {abilities.profile!r} has no PTZ configuration"
            )
        if behavior == "zoom":
            if not spaces.zooms:
                return f"{who} does not say how far it zooms: say reach.zoom_max in the fleet"
            return self._mover.trouble
        if not spaces.positions:
            return f"{who} does not say where it looks: it has no positions, only velocities"
        return self._mover.trouble

    # --- what is done ---------------------------------------------------------------------------

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        """See `CameraDriver`."""
        self._mover.point(pan_rad, tilt_rad, rate_rad_s)

    def zoom(self, level: float) -> None:
        """See `CameraDriver`."""
        self._mover.zoom(level)

    def halt(self) -> None:
        """See `CameraDriver`."""
        self._mover.halt()

    async def take_picture(self) -> Picture:
        """See `CameraDriver`."""
        session, abilities = self._connected()
        if not abilities.snapshot:
            raise CameraError(abilities.no_snapshot, "REJECTED")
        taken_us = self._clock.now_us()
        content, suffix = await fetch_snapshot(session, abilities.snapshot)
        return Picture((taken_us + self._clock.now_us()) // 2, content, suffix)

    async def start_recording(self) -> None:
        """See `CameraDriver`."""
        session, abilities = self._connected()
        if not abilities.records:
            raise CameraError(self.refusal("record_video"), "REJECTED")
        if self._recording is not None:
            # It was to be ended when the camera was away.
            with contextlib.suppress(CameraError):
                await stop_recording(session, self._recording)
        self._recording = None
        self._recording = await start_recording(session, abilities.profile)

    async def stop_recording(self) -> str:
        """See `CameraDriver`."""
        recording = self._recording
        if recording is None:
            raise CameraError(f"{camera(self._settings)} was not told to record")
        session, _ = self._connected()
        try:
            where = await stop_recording(session, recording)
        except RefusedError:
            # The camera does not know of it: it was switched off, or somebody else ended it.
            self._recording = None
            raise
        self._recording = None
        return where

    def _connected(self) -> tuple[Session, Abilities]:
        if self._session is None or self._abilities is None:
            raise CameraError(self._trouble or f"{camera(self._settings)} is away", "LINK_LOST")
        return self._session, self._abilities
