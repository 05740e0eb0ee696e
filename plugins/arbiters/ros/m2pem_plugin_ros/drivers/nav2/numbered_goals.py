"""What the goals of one order are called on the vehicle: an order may need several.

Goal 0 is called as the order is. Goal n differs from it in the last four bytes alone, so that any
goal that is found on the vehicle after a restart is known again, without trying all numbers.
"""

from uuid import UUID

_NUMBERS = (1 << 32) - 1


def numbered(order: UUID, number: int) -> UUID:
    """The goal of that number, from 0 to 2**32 - 1."""
    return UUID(int=order.int ^ (number & _NUMBERS))


def number_of(order: UUID, goal: UUID) -> int | None:
    """Which goal of the order it is; None: it is none of them."""
    difference = order.int ^ goal.int
    return difference if difference <= _NUMBERS else None
