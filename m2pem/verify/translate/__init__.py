"""The translation of a mission, on the fleet that it commands, to a Petri net."""

from m2pem.verify.net.size_limit import SizeLimit, TooLargeError
from m2pem.verify.translate.mission import translate
from m2pem.verify.translate.options import Options

__all__ = ["Options", "SizeLimit", "TooLargeError", "translate"]
