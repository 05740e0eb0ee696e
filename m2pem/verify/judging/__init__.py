"""What a search means for the mission's author: an answer for each property asked by default.

answers = judge(mission, system, explore(system))
"""

from m2pem.verify.judging.judge import judge

__all__ = ["judge"]
