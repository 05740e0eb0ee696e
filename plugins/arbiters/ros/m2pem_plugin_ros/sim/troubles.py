"""What is wrong with the traffic of a vehicle's nodes, for as long as a fault lasts."""

from dataclasses import dataclass


@dataclass(slots=True)
class Troubles:
    """`silent`: nothing is published but what moves the base. `no_odometry`: that alone.

    Of an m2pem or Nav2 node: `refusal`: what it says to every behavior (None: it takes them).
    Of an m2pem node: `deaf`: it hears of no new behavior; `lies`: it tells of behaviors that nobody
    gave it, and contradicts itself; `flood_per_s`: so many statuses in a second of the wall clock.
    """

    silent: bool = False
    no_odometry: bool = False
    refusal: str | None = None
    deaf: bool = False
    lies: bool = False
    flood_per_s: float = 0.0
