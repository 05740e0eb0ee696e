"""Vehicles over MAVSDK, for sites that standardise on it (`connection: {driver: mavsdk}`).

MAVSDK owns the sockets and serial lines, sends the heartbeats, and runs the exchanges that it knows
(commands and missions); how an autopilot is driven, and what is offered, is the same as without it.
"""
