"""Where sockets are, and what becomes of those of dead executives."""

import os
import socket
import stat
import subprocess
from pathlib import Path

import pytest

from m2pem.control_socket.paths import (
    LONGEST_PATH_BYTES,
    ControlSocketError,
    address,
    folder_of,
    live_sockets,
    make_place,
)


def leave_behind(path: Path) -> None:
    """A socket's file to which nobody listens."""
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))


def test_only_the_owner_may_enter_the_folder(tmp_path: Path) -> None:
    journal = tmp_path / "j.db"
    folder_of(journal).mkdir(mode=0o755)
    path = make_place(journal)
    assert path.parent == folder_of(journal)
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700


def test_a_link_to_another_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    folder_of(tmp_path / "j.db").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(ControlSocketError, match="own"):
        make_place(tmp_path / "j.db")


def test_a_path_too_long_for_a_socket_has_a_short_address(tmp_path: Path) -> None:
    path = make_place(tmp_path / ("j" * 100))
    with socket.socket(socket.AF_UNIX) as listening:
        with address(path) as here:
            assert len(here) <= LONGEST_PATH_BYTES
            listening.bind(here)
        listening.listen()
        assert list(live_sockets(tmp_path / ("j" * 100))) == [path]


def test_a_path_too_long_is_told_where_there_is_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "is_dir", lambda _: False)
    with pytest.raises(ControlSocketError, match="longer"), address(tmp_path / ("j" * 100)):
        pass


def test_a_missing_folder_of_the_journal_is_told(tmp_path: Path) -> None:
    with pytest.raises(ControlSocketError, match="No such file"):
        make_place(tmp_path / "no" / "j.db")


def test_the_socket_of_a_dead_executive_is_removed(tmp_path: Path) -> None:
    ended = subprocess.Popen(["true"])
    ended.wait()
    path = make_place(tmp_path / "j.db").with_name(f"{ended.pid}.sock")
    leave_behind(path)
    assert list(live_sockets(tmp_path / "j.db")) == []
    assert not path.exists()


def test_the_socket_of_one_that_is_about_to_listen_stays(tmp_path: Path) -> None:
    path = make_place(tmp_path / "j.db").with_name(f"{os.getpid()}.sock")
    leave_behind(path)
    assert list(live_sockets(tmp_path / "j.db")) == []
    assert path.exists()
