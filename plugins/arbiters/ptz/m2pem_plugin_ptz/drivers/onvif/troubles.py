"""What can be wrong between a driver and its camera, and whose fault it is."""

from typing import Any

from m2pem_plugin_ptz.drivers.driver import CameraError
from m2pem_plugin_ptz.drivers.onvif.onvif_zeep import require
from m2pem_plugin_ptz.drivers.onvif.settings import OnvifSettings


class SilentError(CameraError):
    """The camera did not answer."""


class UnauthorizedError(CameraError):
    """The camera did not let this user do it."""


class RefusedError(CameraError):
    """The camera answered with a fault, or with something that is no answer."""


def camera(settings: OnvifSettings) -> str:
    """Which one, for people."""
    return f"the ONVIF camera at {settings.address}"


def silent(settings: OnvifSettings, error: BaseException) -> SilentError:
    """Nothing came back."""
    if isinstance(error, TimeoutError):
        why = f"nothing within {settings.timeout_s:g} s"
    else:
        why = str(error) or type(error).__name__
    return SilentError(f"{camera(settings)} does not answer: {why}", "LINK_LOST")


def unauthorized(settings: OnvifSettings, user: str | None) -> UnauthorizedError:
    """Wrong user, wrong password, or none."""
    if user is None or settings.credentials is None:
        return UnauthorizedError(
            f"{camera(settings)} asks for a user and a password: write them into a file, and name "
            "it as connection.credentials",
            "REJECTED",
        )
    return UnauthorizedError(
        f"{camera(settings)} refuses user {user!r}: correct user or password in "
        f"{settings.credentials}, or what the user may do in the camera",
        "REJECTED",
    )


def translated(
    error: Exception, operation: str, settings: OnvifSettings, user: str | None
) -> CameraError:
    """What a call of the library raised, as the operator should read it."""
    import aiohttp  # noqa: PLC0415  # comes with the library
    import zeep.exceptions  # noqa: PLC0415

    if isinstance(error, CameraError):
        return error
    if isinstance(
        error, TimeoutError | aiohttp.ClientConnectionError | aiohttp.ClientPayloadError | OSError
    ):
        return silent(settings, error)
    if isinstance(error, zeep.exceptions.Fault):
        if require("onvif.util").is_auth_error(error):
            return unauthorized(settings, user)
        return RefusedError(f"{camera(settings)} refuses {operation}: {fault_text(error)}")
    if isinstance(error, zeep.exceptions.TransportError) and error.status_code in (401, 403):
        return unauthorized(settings, user)
    text = " ".join(str(error).split())[:200]
    return RefusedError(f"{camera(settings)} answers {operation} with what is no ONVIF: {text}")


def fault_text(fault: Any) -> str:
    """Its text and its codes."""
    codes = [str(getattr(code, "localname", code)) for code in fault.subcodes or ()]
    text = " ".join(str(fault.message or "").split())[:200]
    return f"{text} ({', '.join(codes)})" if codes else text or "no reason given"
