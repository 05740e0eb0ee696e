"""Format times and names for the screen."""

from rich.cells import cell_len, set_cell_size


def clock_time(seconds: float) -> str:
    """Format hours, minutes and whole seconds: "3:07", "1:02:09"."""
    whole = max(0, int(seconds))
    hours, rest = divmod(whole, 3600)
    minutes, last = divmod(rest, 60)
    return f"{hours}:{minutes:02}:{last:02}" if hours else f"{minutes}:{last:02}"


def shortened(text: str, width: int) -> str:
    """Shorten a text to one line of at most `width` cells; "…" marks what is cut off."""
    text = " ".join(text.split())
    text = "".join(each for each in text if each.isprintable())
    if cell_len(text) <= width:
        return text
    return set_cell_size(text, max(0, width - 1)).rstrip() + "…" if width > 0 else ""
