"""Videos in fleet files: what is read, and what is wrong with them."""

from pathlib import Path

import pytest

from m2pem.errors import FleetError
from m2pem.fleet.fleet import Fleet, Video, VideoKind, digest_of, dump, restore, simulated_fleet
from m2pem.fleet.fleet_file import load_fleet
from m2pem.mission.catalogue import ResourceId

CAMERA = ResourceId("uav1/cam")


def fleet(folder: Path, video: str) -> Fleet:
    file = folder / "fleet.yaml"
    file.write_text(
        "version: 1\n"
        "vehicles:\n"
        "  uav1:\n"
        "    domain: air\n"
        "    arbiter: sim\n"
        "    payloads:\n"
        f"      cam: {{connection: {{kind: ptz}}{video}}}\n"
    )
    return load_fleet(file)


def test_a_payload_has_a_video(tmp_path: Path) -> None:
    read = fleet(tmp_path, ", video: {url: 'http://10.0.0.5:8889/cam/whep', kind: webrtc}")
    assert read.videos == {CAMERA: Video("http://10.0.0.5:8889/cam/whep", VideoKind.WEBRTC)}
    assert simulated_fleet(read).videos == read.videos
    still = fleet(tmp_path, ", video: {url: 'https://cam/x.jpg?w=2', kind: image, every: 500 ms}")
    assert still.videos[CAMERA].every_s == 0.5


def test_no_journal_has_the_address_and_no_run_depends_on_it(tmp_path: Path) -> None:
    read = fleet(tmp_path, ", video: {url: 'http://10.0.0.5/cam', kind: hls}")
    assert b"10.0.0.5" not in dump(read)
    assert restore(dump(read)).videos == {}
    assert digest_of(read) == digest_of(fleet(tmp_path, ""))


@pytest.mark.parametrize(
    ("video", "rule", "message"),
    [
        ("url: 'http://me:secret@cam/x', kind: hls", "video-url", "no user and no password"),
        ("url: 'rtsp://cam/x', kind: hls", "video-url", "not an address of http or https"),
        ("url: 'http:///x', kind: hls", "video-url", "not an address of http or https"),
        ("url: 'http://cam:x/', kind: hls", "video-url", "is not an address"),
        ("url: 'http://a;script-src/', kind: hls", "video-url", "not an address of http"),
        ("url: 'http://cam/a b', kind: hls", "video-url", "not an address of http"),
        ("url: 'http://cam/x', kind: hls, every: 1 s", "video-every", "one at a time"),
        ("url: 'http://cam/x', kind: rtsp", "shape", ""),
    ],
)
def test_a_video_that_no_page_can_show_is_refused(
    tmp_path: Path, video: str, rule: str, message: str
) -> None:
    with pytest.raises(FleetError) as caught:
        fleet(tmp_path, f", video: {{{video}}}")
    (found,) = caught.value.findings
    assert rule in {"shape", found.rule}
    assert message in found.message
    assert "secret" not in found.message
    assert found.line == 7
