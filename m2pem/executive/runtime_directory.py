"""Where executives of this user keep what must outlive none of them for long: locks and marks."""

import os
import tempfile
from pathlib import Path

VARIABLE = "M2PEM_RUNTIME_DIR"
"""The environment variable that names the folder."""


def runtime_directory() -> Path:
    """A folder of this user's own: not of the session, whose environment may say another one.

    Raises:
        OSError: it cannot be made, or belongs to another user.
    """
    configured = os.environ.get(VARIABLE, "")
    user = os.geteuid()
    session = Path(f"/run/user/{user}")
    if configured:
        folder = Path(configured)
    elif session.is_dir() and session.stat().st_uid == user:
        folder = session / "m2pem"
    else:
        folder = Path(tempfile.gettempdir()) / f"m2pem-{user}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.lstat().st_uid != user:
        raise PermissionError(1, "is not a folder of this user's own", str(folder))
    return folder
