"""URLs are read as MAVSDK writes them; others are told what would be right."""

import pytest
from m2pem_plugin_mavlink.protocol.url import SerialUrl, SocketUrl, Way, parse_url

from m2pem.errors import PluginError


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("udpin://127.0.0.1:14550", SocketUrl(Way.UDP_IN, "127.0.0.1", 14550)),
        ("udpin://0.0.0.0:14550", SocketUrl(Way.UDP_IN, "0.0.0.0", 14550)),
        ("udpin://127.0.0.1:0", SocketUrl(Way.UDP_IN, "127.0.0.1", 0)),
        ("udpout://192.168.1.12:14550", SocketUrl(Way.UDP_OUT, "192.168.1.12", 14550)),
        ("UDPOUT://rover.local:14550/", SocketUrl(Way.UDP_OUT, "rover.local", 14550)),
        ("tcpout://localhost:5760", SocketUrl(Way.TCP_OUT, "localhost", 5760)),
        ("tcpin://[::1]:5760", SocketUrl(Way.TCP_IN, "::1", 5760)),
        ("serial:///dev/ttyACM0:57600", SerialUrl("/dev/ttyACM0", 57600)),
        ("serial:///dev/ttyACM0", SerialUrl("/dev/ttyACM0", 57600)),
        ("serial://COM7:921600", SerialUrl("COM7", 921600)),
        (
            "serial:///dev/serial/by-path/pci-0:0-usb-0:1:1.0",
            SerialUrl("/dev/serial/by-path/pci-0:0-usb-0:1:1.0", 57600),
        ),
    ],
)
def test_a_url_is_read_and_written_again(text: str, url: SocketUrl | SerialUrl) -> None:
    assert parse_url(text) == url
    assert parse_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("udp://127.0.0.1:14550", "did you mean udpin://127.0.0.1:14550 (to listen) or udpout://"),
        ("tcp:127.0.0.1:5760", "did you mean tcpin://127.0.0.1:5760 (to listen) or tcpout://"),
        ("udpin:127.0.0.1:14550", "did you mean udpin://127.0.0.1:14550?"),
        ("udpinn://127.0.0.1:14550", "did you mean udpin://127.0.0.1:14550?"),
        ("serail:///dev/ttyACM0:57600", "did you mean serial:///dev/ttyACM0:57600?"),
        ("serial:/dev/ttyACM0:57600", "did you mean serial:///dev/ttyACM0:57600?"),
        ("serial://dev/ttyACM0:57600", "did you mean serial:///dev/ttyACM0:57600?"),
        ("/dev/ttyACM0", "serial:///dev/ttyACM0:57600"),
        ("/dev/ttyACM0,115200", "serial:///dev/ttyACM0:115200"),
        ("http://127.0.0.1:80", "is none of udpin, udpout, tcpin, tcpout, serial"),
        ("127.0.0.1:14550", "is not a URL"),
        ("", "is not a URL"),
        ("udpin://:14550", "udpin://0.0.0.0:14550 on all its addresses"),
        ("udpout://:14550", "did you mean udpout://127.0.0.1:14550?"),
        ("udpin://127.0.0.1", "its port must be a number"),
        ("udpin://127.0.0.1:mavlink", "its port must be a number"),
        ("udpin://127.0.0.1:65536", "from 0 to 65535"),
        ("udpout://127.0.0.1:0", "from 1 to 65535"),
        ("udpout://rover..local:1", "'rover..local' is not a host name"),
        ("udpin://a b:1", "a host and a port"),
        ("udpin://::1:14550", "a host and a port"),
        ("serial:///dev/ttyACM0:fast", "its baudrate must be a number"),
        ("serial:///dev/ttyACM0:0", "its baudrate must be from 1"),
        ("serial://", "no device"),
    ],
)
def test_a_wrong_url_is_told_what_would_be_right(text: str, remedy: str) -> None:
    with pytest.raises(PluginError) as caught:
        parse_url(text)
    assert remedy in str(caught.value)
