"""What a camera that looks straight down sees: spacing, trigger distance and ground resolution."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SurveyCamera:
    """A camera whose images lie with their width across the track."""

    sensor_width_mm: float
    sensor_height_mm: float
    focal_length_mm: float
    image_width_px: int
    image_height_px: int


KNOWN_CAMERAS: Mapping[str, SurveyCamera] = {
    "Canon EOS-M, 22 mm": SurveyCamera(22.3, 14.9, 22.0, 5184, 3456),
    "Canon PowerShot S100, 5.2 mm": SurveyCamera(7.6, 5.7, 5.2, 4000, 3000),
    "DJI Mavic 2 Pro": SurveyCamera(13.2, 8.8, 10.26, 5472, 3648),
    "DJI Phantom 4 Pro": SurveyCamera(13.2, 8.8, 8.8, 5472, 3648),
    "DJI Zenmuse P1, 35 mm": SurveyCamera(35.9, 24.0, 35.0, 8192, 5460),
    "MicaSense RedEdge": SurveyCamera(4.8, 3.6, 5.5, 1280, 960),
    "Sony a6000, 16 mm": SurveyCamera(23.5, 15.6, 16.0, 6000, 4000),
    "Sony DSC-RX1R II, 35 mm": SurveyCamera(35.9, 24.0, 35.0, 7952, 5304),
    "Sony QX1, 16 mm": SurveyCamera(23.2, 15.4, 16.0, 5456, 3632),
}
"""Cameras of surveys, with the numbers of their makers' data sheets."""


@dataclass(frozen=True, slots=True)
class ImagePlan:
    """How images of a survey overlap. `ground_resolution_m`: of one pixel."""

    spacing_m: float
    trigger_distance_m: float
    ground_resolution_m: float


def image_plan(
    camera: SurveyCamera, height_m: float, front_overlap: float, side_overlap: float
) -> ImagePlan:
    """Return the spacing of passes and of images along them, from a height above ground.

    Overlaps are shares of an image, from 0 to below 1.

    Raises:
        ValueError: the height is not above 0, or an overlap is out of range.
    """
    if height_m <= 0:
        raise ValueError(f"a camera needs a height above ground, not {height_m:g} m")
    for name, overlap in (("front_overlap", front_overlap), ("side_overlap", side_overlap)):
        if not 0 <= overlap < 1:
            raise ValueError(f"{name} {overlap:g} is not from 0 to below 1")
    across_m = height_m * camera.sensor_width_mm / camera.focal_length_mm
    along_m = height_m * camera.sensor_height_mm / camera.focal_length_mm
    return ImagePlan(
        spacing_m=across_m * (1 - side_overlap),
        trigger_distance_m=along_m * (1 - front_overlap),
        ground_resolution_m=max(across_m / camera.image_width_px, along_m / camera.image_height_px),
    )
