"""`m2pem doctor` for the page: its settings and its port."""

import socket
from pathlib import Path

from m2pem_plugin_web.host_checks import check_host

from m2pem.api import HealthStatus


def test_a_free_port_is_right() -> None:
    (check,) = check_host({"M2PEM_WEB_PORT": "0"})
    assert check.status is HealthStatus.OK


def test_a_port_in_use_is_a_warning_as_the_page_may_be_served_already() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        (check,) = check_host({"M2PEM_WEB_PORT": str(other.getsockname()[1])})
    assert check.status is HealthStatus.WARNING
    assert "M2PEM_WEB_PORT=0 takes any free port" in check.remedy


def test_settings_that_are_refused_are_an_error() -> None:
    (check,) = check_host({"M2PEM_WEB_HOST": "0.0.0.0"})
    assert check.status is HealthStatus.ERROR
    assert "TLS (M2PEM_WEB_CERT, M2PEM_WEB_KEY)" in check.message


def test_a_file_of_users_that_others_can_read_is_an_error(tmp_path: Path) -> None:
    users = tmp_path / "users.json"
    users.write_text("[]")
    users.chmod(0o644)
    (check,) = check_host({"M2PEM_WEB_USERS": str(users), "M2PEM_WEB_PORT": "0"})
    assert check.status is HealthStatus.ERROR
    assert str(users) in check.message
