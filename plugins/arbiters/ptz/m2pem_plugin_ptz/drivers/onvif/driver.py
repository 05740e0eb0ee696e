"""The driver of an ONVIF camera (Profiles S and T; G for recording)."""

import asyncio
import contextlib
import math

from m2pem.api.latest_task import cancel_and_wait
from m2pem.errors import PluginError
from m2pem_plugin_ptz.drivers.driver import CameraError, DriverSetup
from m2pem_plugin_ptz.drivers.onvif.capabilities import Capabilities, read_capabilities
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
from m2pem_plugin_ptz.gimbal import CapturedImage, PanTiltZoom, Reach

FIRST_RETRY_S = 0.5
LONGEST_RETRY_S = 5.0
REFUSED_RETRY_S = 60.0
"""Cameras lock out users who retry with a wrong password too often."""

LOOK_AT_FILE_S = 0.5
"""Period of the check for a corrected password file."""


class OnvifDriver:
    """Implements `CameraDriver` (docs/ptz.md).

    Raises:
        PluginError: a setting cannot be used; the text names the resource and the key.
    """

    def __init__(self, setup: DriverSetup) -> None:
        self._settings = read_onvif(setup.connection.resource, setup.settings.own)
        self._name = f"{setup.connection.resource}: {camera(self._settings)}"
        self._fleet_reach = setup.settings.reach
        self._clock, self._logger = setup.context.clock, setup.context.logger
        self._mover = Mover(self._clock, self._logger, setup.on_contact, camera(self._settings))
        self._session: Session | None = None
        self._capabilities: Capabilities | None = None
        self._recording: Recording | None = None
        self._problem = f"{camera(self._settings)} has not answered yet"
        self._logged = ""
        self._clock_doubted_us = -math.inf
        self._task: asyncio.Task[None] | None = None

    # --- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        await asyncio.to_thread(require)
        credentials = self._credentials()
        self._task = asyncio.get_running_loop().create_task(self._stay_connected(credentials))

    async def close(self) -> None:
        task, self._task = self._task, None
        await cancel_and_wait(task)

    def _credentials(self) -> Credentials | None:
        path = self._settings.credentials
        return None if path is None else read_credentials(path)

    async def _stay_connected(self, credentials: Credentials | None) -> None:
        retry_s = FIRST_RETRY_S
        while True:
            try:
                session = Session(self._settings, credentials)
                try:
                    await self._run_session(session)
                finally:
                    self._session = None
                    await session.close()
            except UnauthorizedError as error:
                if self._may_be_the_clock():
                    continue
                self._report(error.reason)
                await self._until_file_changes(REFUSED_RETRY_S)
            except CameraError as error:
                if not self._problem:
                    retry_s = FIRST_RETRY_S
                self._report(error.reason)
                await self._clock.sleep(retry_s)
                retry_s = min(2 * retry_s, LONGEST_RETRY_S)
            except Exception as error:
                # An invalid answer of the camera must not end its driver.
                self._logger.exception("%s", self._name)
                self._report(f"{self._name}: {type(error).__name__}: {error}")
                await self._clock.sleep(LONGEST_RETRY_S)
            try:
                credentials = self._credentials()
            except PluginError as error:
                self._report(str(error))
                await self._until_file_changes(LONGEST_RETRY_S)

    def _may_be_the_clock(self) -> bool:
        """Whether the password may be refused because the clock of the camera has changed."""
        now_us = self._clock.now_us()
        if not self._mover.answered or now_us - self._clock_doubted_us < REFUSED_RETRY_S * 1e6:
            return False
        self._clock_doubted_us = now_us
        return True

    async def _run_session(self, session: Session) -> None:
        await session.open()
        self._capabilities = await read_capabilities(session, self._fleet_reach)
        self._session = session
        if self._logged:
            self._logger.info("%s answers", self._name)
        self._problem = self._logged = ""
        await self._mover.run(session, self._capabilities)

    def _report(self, problem: str) -> None:
        self._problem = problem
        if self._logged != problem:
            self._logger.warning("%s", problem)
        self._logged = problem

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

    # --- state ----------------------------------------------------------------------------------

    @property
    def ptz(self) -> PanTiltZoom | None:
        return self._mover.ptz

    @property
    def reach(self) -> Reach:
        """The limits of the camera; until it has answered, those of the fleet."""
        spaces = self._capabilities.spaces if self._capabilities is not None else None
        return self._fleet_reach if spaces is None else spaces.reach

    def refusal(self, behavior: str) -> str:
        capabilities = self._capabilities
        if self._problem or capabilities is None:
            return self._problem
        who = camera(self._settings)
        if not self._mover.says_position:
            return f"{who} does not report its direction (GetStatus has no known position)"
        if behavior == "take_picture":
            return capabilities.no_snapshot
        if behavior == "record_video":
            return (
                "" if capabilities.records else f"{who} has no recording service (ONVIF Profile G)"
            )
        spaces = capabilities.spaces
        if spaces is None:
            profile = capabilities.profile
            return f"{who} does not turn: its profile {profile!r} has no PTZ configuration"
        if behavior == "zoom":
            if not spaces.zooms:
                return f"{who} does not report its zoom range: set reach.zoom_max in the fleet"
            return self._mover.problem
        if not spaces.positions:
            return f"{who} does not report its direction: it has velocities, but no positions"
        return self._mover.problem

    # --- execution ------------------------------------------------------------------------------

    def point(self, pan_rad: float, tilt_rad: float, rate_rad_s: float | None = None) -> None:
        self._mover.point(pan_rad, tilt_rad, rate_rad_s)

    def zoom(self, level: float) -> None:
        self._mover.zoom(level)

    def halt(self) -> None:
        self._mover.halt()

    async def take_picture(self) -> CapturedImage:
        session, capabilities = self._connected()
        if not capabilities.snapshot:
            raise CameraError(capabilities.no_snapshot, "REJECTED")
        taken_us = self._clock.now_us()
        content, suffix = await fetch_snapshot(session, capabilities.snapshot)
        return CapturedImage((taken_us + self._clock.now_us()) // 2, content, suffix)

    async def start_recording(self) -> None:
        session, capabilities = self._connected()
        if not capabilities.records:
            raise CameraError(self.refusal("record_video"), "REJECTED")
        if self._recording is not None:
            # The last video could not be ended while the camera was not connected.
            with contextlib.suppress(CameraError):
                await stop_recording(session, self._recording)
        self._recording = None
        self._recording = await start_recording(session, capabilities.profile)

    async def stop_recording(self) -> str:
        recording = self._recording
        if recording is None:
            raise CameraError(f"{camera(self._settings)} is not recording")
        session, _ = self._connected()
        try:
            where = await stop_recording(session, recording)
        except RefusedError:
            # The camera has no such job: it was switched off, or another client ended the
            # recording.
            self._recording = None
            raise
        self._recording = None
        return where

    def _connected(self) -> tuple[Session, Capabilities]:
        if self._session is None or self._capabilities is None:
            raise CameraError(
                self._problem or f"{camera(self._settings)} is not connected", "LINK_LOST"
            )
        return self._session, self._capabilities
