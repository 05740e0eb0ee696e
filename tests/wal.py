"""SQLite's write-ahead log, as far as tests that harm it must know it."""

FRAME_BYTES = 24 + 4096
HEAD_BYTES = 32


def commits(log: bytes) -> list[int]:
    """Where each commit of a log ends, in bytes. What follows the last is of an earlier round."""
    salts, place = log[16:24], HEAD_BYTES
    ends = []
    while place + FRAME_BYTES <= len(log) and log[place + 8 : place + 16] == salts:
        if any(log[place + 4 : place + 8]):
            ends.append(place + FRAME_BYTES)
        place += FRAME_BYTES
    return ends
