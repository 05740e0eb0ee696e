"""The frames of ArduPilot, and where the programs of ArduPilot and PX4 and their parameters are."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from m2pem.errors import M2pemError
from m2pem_plugin_mavlink.vehicle.identity import Kind

COPTER, ROVER, PLANE, SUB = "arducopter", "ardurover", "arduplane", "ardusub"

DEFAULTS: Mapping[str, str] = {
    COPTER: "default_params/copter.parm",
    ROVER: "default_params/rover.parm",
    PLANE: "models/plane.parm",
    SUB: "default_params/sub.parm",
}
"""The parameters that the usual frame of a program needs, below Tools/autotest."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame of ArduPilot. `name` is its `--model`; `parameters`: files below Tools/autotest."""

    name: str
    program: str
    kind: Kind
    parameters: tuple[str, ...]


def _frame(name: str, program: str, kind: Kind, *more: str) -> Frame:
    return Frame(name, program, kind, (DEFAULTS[program], *more))


FRAMES: Mapping[str, Frame] = {
    frame.name: frame
    for frame in (
        _frame("quad", COPTER, Kind.COPTER),
        _frame("hexa", COPTER, Kind.COPTER, "default_params/copter-hexa.parm"),
        _frame("plane", PLANE, Kind.PLANE),
        Frame("quadplane", PLANE, Kind.VTOL, ("default_params/quadplane.parm",)),
        _frame("rover", ROVER, Kind.ROVER),
        _frame("rover-skid", ROVER, Kind.ROVER, "default_params/rover-skid.parm"),
        _frame("motorboat", ROVER, Kind.BOAT, "default_params/motorboat.parm"),
        _frame("vectored", SUB, Kind.SUB),
    )
}

FRAMES_OF: Mapping[str, tuple[str, ...]] = {
    "air": ("quad", "hexa", "plane", "quadplane"),
    "ground": ("rover", "rover-skid"),
    "surface": ("motorboat",),
    "subsurface": ("vectored",),
}
"""The frames of a domain, the usual one first."""

PX4_MODELS: Mapping[str, str] = {"air": "sihsim_quadx", "ground": "sihsim_rover_ackermann"}
"""The usual model of PX4's own simulation (SIH) of a domain."""

TREE = Path("build/sitl/bin")
"""Where a source tree of ArduPilot has its programs."""

AUTOTEST = Path("Tools/autotest")
PX4_BUILDS = (".", "build/px4_sitl_sih", "build/px4_sitl_default")
AIRFRAMES = Path("init.d-posix/airframes")


class SitlError(M2pemError):
    """A program or its parameters are not where the command line says; the text says where they
    are looked for."""

    exit_status = 2


@dataclass(frozen=True, slots=True)
class ArduPilotProgram:
    """`path` is a program of ArduPilot, or a link to it; `parameters`: files for `--defaults`."""

    path: Path
    parameters: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class Px4Program:
    """`path` is the program `px4`, `etc` the folder of its start scripts."""

    path: Path
    etc: Path

    def models(self) -> tuple[str, ...]:
        """The models that PX4 simulates by itself (SIH)."""
        names = (file.name.partition("_")[2] for file in (self.etc / AIRFRAMES).glob("*_sihsim_*"))
        return tuple(sorted(name for name in names if "." not in name))


def find_ardupilot(folder: Path, frame: Frame) -> ArduPilotProgram:
    """The program that simulates `frame`, in a source tree or a folder of programs.

    Raises:
        SitlError: the program or one of its parameter files is not there.
    """
    places = [folder / TREE, folder / "bin", folder]
    for place in places:
        if (place / frame.program).is_file():
            return ardupilot_program(place / frame.program, frame)
    raise SitlError(
        f"--ardupilot {folder}: no program {frame.program} in {_listed(places)}; build it with "
        f"`./waf configure --board sitl && ./waf --targets bin/{frame.program}`"
    )


def ardupilot_program(path: Path, frame: Frame) -> ArduPilotProgram:
    """A program with its parameter files: those beside `path`, then beside what it links to, then
    in the source tree that the program was built in.

    Raises:
        SitlError: one of the files is in none of these places.
    """
    path = path.absolute()
    return ArduPilotProgram(path, tuple(_parameters(path, frame)))


def _parameters(path: Path, frame: Frame) -> Iterator[Path]:
    beside = dict.fromkeys((path.parent, path.resolve().parent))
    trees = [folder.parents[len(TREE.parts) - 1] for folder in beside if _is_built(folder)]
    for file in frame.parameters:
        names = [Path(file).name]
        if file == DEFAULTS[frame.program]:
            names.insert(0, f"{frame.program}.parm")
        places = [folder / name for folder in beside for name in names]
        places += [tree / AUTOTEST / file for tree in trees]
        found = next((place for place in places if place.is_file()), None)
        if found is None:
            raise SitlError(
                f"{path}: {frame.name} needs the parameters {AUTOTEST / file} of ArduPilot's "
                f"source; copy them to {path.parent / names[0]}"
            )
        yield found


def _is_built(folder: Path) -> bool:
    return folder.parts[-len(TREE.parts) :] == TREE.parts


def find_px4(folder: Path) -> Px4Program:
    """PX4's program, in a folder with `bin` and `etc`, or in a source tree.

    Raises:
        SitlError: it is not there.
    """
    for build in PX4_BUILDS:
        place = folder / build
        if (place / "bin/px4").is_file() and (place / "etc").is_dir():
            return Px4Program((place / "bin/px4").absolute(), (place / "etc").absolute())
    raise SitlError(
        f"--px4 {folder}: no bin/px4 with etc beside bin, nor in "
        f"{_listed(folder / build for build in PX4_BUILDS[1:])}; build it with `make px4_sitl_sih`"
    )


def _listed(places: "Iterator[Path] | list[Path]") -> str:
    return " or ".join(map(str, places))
