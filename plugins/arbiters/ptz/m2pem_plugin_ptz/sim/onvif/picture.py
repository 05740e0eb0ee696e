"""What the simulated camera sees: a horizon, bearings, and where it looks, as a JPEG."""

import io
import math

from PIL import Image, ImageDraw

SIZE = (640, 360)
SKY, GROUND, INK, PAPER = (126, 168, 206), (116, 128, 92), (250, 250, 250), (20, 20, 20)
SPACING = 10
"""Degrees between lines."""


def draw(
    pan_rad: float, tilt_rad: float, zoom: float, view_rad: tuple[float, float], note: str
) -> bytes:
    """A picture. `view_rad`: width and height of what it sees at zoom 1."""
    width, height = SIZE
    image = Image.new("RGB", SIZE, SKY)
    canvas = ImageDraw.Draw(image)
    focal = width / 2 / math.tan(view_rad[0] / 2) * zoom
    pan_deg, tilt_deg = math.degrees(pan_rad), math.degrees(tilt_rad)
    if abs(tilt_rad) < math.radians(80):
        horizon = height / 2 + focal * math.tan(tilt_rad)
    else:
        horizon = -1.0 if tilt_rad < 0 else height + 1.0
    canvas.rectangle((0, max(0.0, horizon), width, max(0.0, height)), fill=GROUND)
    half = math.degrees(math.atan(width / 2 / focal))
    first = math.ceil((pan_deg - half) / SPACING) * SPACING
    for bearing in range(first, int(pan_deg + half) + 1, SPACING):
        x = width / 2 + focal * math.tan(math.radians(bearing - pan_deg))
        canvas.line((x, 0, x, height), fill=INK)
        canvas.text((x + 3, 3), f"{(bearing + 180) % 360 - 180:d}", fill=INK)
    canvas.line((width / 2 - 12, height / 2, width / 2 + 12, height / 2), fill=PAPER, width=2)
    canvas.line((width / 2, height / 2 - 12, width / 2, height / 2 + 12), fill=PAPER, width=2)
    text = f"pan {pan_deg:+.1f}  tilt {tilt_deg:+.1f}  zoom {zoom:.1f}  {note}"
    canvas.rectangle((0, height - 18, width, height), fill=PAPER)
    canvas.text((6, height - 15), text, fill=INK)
    stored = io.BytesIO()
    image.save(stored, "JPEG", quality=85, comment=text.encode())
    return stored.getvalue()
