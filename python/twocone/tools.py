# SPDX-License-Identifier: Apache-2.0
"""The program's tools as functions: each does what the subcommand of its name does, and returns its numbers."""

import collections.abc
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twocone import _arguments, _native
from twocone.runs import Run


@dataclass(frozen=True)
class Parameter:
    """A number of the rig, before and after a calibration."""

    name: str  #: its key in a robot file
    before: float
    after: float
    sigma: float
    prior_sigma: float
    observed: bool  #: whether the drive shows it; where not, it was kept


@dataclass(frozen=True)
class Belief:
    """The joint belief about a rig and landmarks."""

    names: list[str]
    values: np.ndarray
    covariance: np.ndarray

    def sigma(self, name: str) -> float:
        """Returns the standard deviation of a number."""
        return float(np.sqrt(self.covariance[self.names.index(name), self.names.index(name)]))


@dataclass(frozen=True)
class Calibration:
    """A calibrated rig. ``content`` is the whole calibration.json."""

    robot_file: Path
    parameters: dict[str, Parameter]
    belief: Belief | None
    rms_before_px: tuple[float, float]  #: of the sightings' residuals, lower and upper
    rms_after_px: tuple[float, float]
    settled: bool
    content: dict


@dataclass(frozen=True)
class Survey:
    """The landmarks of a room. ``content`` is the whole survey.json."""

    map_file: Path
    names: list[str]
    places_m: np.ndarray  #: rows of x, y, top, radius
    sigmas_m: np.ndarray  #: likewise
    belief: Belief | None
    left_out: list[str]
    content: dict


@dataclass(frozen=True)
class Design:
    """A designed pair of mirrors. ``content`` is the whole design.json."""

    robot_file: Path
    distances_m: np.ndarray
    least_sigma_m: np.ndarray  #: of a range at each distance; nan where both mirrors show nothing in common
    most_sigma_m: np.ndarray
    content: dict


@dataclass(frozen=True)
class Sweep:
    """Accuracy and costs of many settings. ``content`` is the whole tradeoff.json."""

    folder: Path
    settings: list[dict]
    content: dict

    def column(self, name: str) -> np.ndarray:
        """Returns a number of all settings by its name in tradeoff.csv; nan where there is none."""
        values = [setting.get(name) for setting in self.settings]
        return np.array([np.nan if value is None else value for value in values])


@dataclass(frozen=True)
class Comparison:
    """The differences of a real run from a simulated one. ``content`` is the whole compare.json."""

    folder: Path
    within_limits: bool
    differing: list[str]  #: names of the sources that differ
    rows: list[dict]
    gaps: list[dict]
    sources: list[dict]
    content: dict


def _belief(content):
    belief = content.get("belief")
    if belief is None:
        return None
    return Belief(belief["names"], np.array(belief["values"]), np.array(belief["covariance"]))


def _folders(runs):
    """Returns the folders of one or several runs, which are given by their folders or as Run."""
    if isinstance(runs, (str, Path, Run)):
        runs = [runs]
    return [run.folder if isinstance(run, Run) else Path(run) for run in runs]


def _one_folder(run):
    return run.folder if isinstance(run, Run) else Path(run)


def calibrate(runs, *, out, robot="", frames: int = 90, priors: dict[str, float] | None = None, distortion: bool = False,
              figures="", force: bool = False) -> Calibration:
    """Finds the rig's own errors from drives among known landmarks, and writes a corrected robot file.

    :param runs: a run or several, all of one robot
    :param out: robot file to write, with its calibration.json, and a map where the landmarks were refined
    :param robot: robot file to start from; empty: the runs' own
    :param priors: standard deviations by their names, such as ``{"tilt_rad": 0.01}``
    :param distortion: also find k1 and k2 of both lenses
    :param figures: folder for figures of the residuals; empty: none
    """
    frames = _arguments.frames_to_use(frames)
    content = json.loads(_native.calibrate(_folders(runs), out, robot, frames, priors or {}, distortion, figures, force))
    names = Parameter.__dataclass_fields__
    parameters = {p["name"]: Parameter(**{key: p[key] for key in names}) for p in content["parameters"]}
    lower, upper = content["views"]["lower"], content["views"]["upper"]
    return Calibration(Path(out), parameters, _belief(content), (lower["rms_before_px"], upper["rms_before_px"]),
                       (lower["rms_after_px"], upper["rms_after_px"]), content["settled"], content)


def survey(runs, *, out, robot="", calibrate_to="", distances: collections.abc.Sequence[tuple[str, str, float]] = (), distance_sigma_m=0.002,
           refine: bool = False, frames: int = 180, force: bool = False) -> Survey:
    """Finds the landmarks of a room from drives without a map of them, and writes their map.

    :param out: map file to write
    :param calibrate_to: robot file to write: the rig is found, too; empty: it is taken as it is believed
    :param distances: by tape, as ``("red", "blue", 2.34)``; needs ``calibrate_to``
    :param refine: the robot's map is refined within its sigmas, and landmarks that were moved are named
    """
    frames = _arguments.frames_to_use(frames)
    distance_sigma_m = _arguments.positive("distance_sigma_m", distance_sigma_m)
    distances = [(first, second, _arguments.positive("a distance", distance_m)) for first, second, distance_m in distances]
    if distances and not calibrate_to:
        raise ValueError("distances need calibrate_to: a distance corrects the sizes of the rig, which give the scale")
    content = json.loads(_native.survey(_folders(runs), out, robot, calibrate_to, distances, distance_sigma_m, refine,
                                        frames, force))
    landmarks = content["landmarks"]
    keys = ("x_m", "y_m", "top_m", "radius_m")
    places = np.array([[l[key] for key in keys] for l in landmarks])
    sigmas = np.array([l["sigma_m"] for l in landmarks])
    return Survey(Path(out), [l["name"] for l in landmarks], places, sigmas, _belief(content), content["left_out"], content)


def design(*, out, name: str = "design", map="", force: bool = False, **requirements: float) -> Design:
    """Designs a pair of mirrors from requirements, and writes its robot file with a simulated twin.

    :param out: folder for the files and the page
    :param map: map of the room in which the robot shall find its place; empty: a room with six landmarks
    :param requirements: numbers by their names in apps/design/design.h, such as ``floor_from_m=1.4`` or ``sigma_m=0.02``
    :raises twocone.Error: if no pair of cones does what is required; the text names the nearest that can
    """
    content = json.loads(_native.design(out, name, requirements, map, force))
    distances = content["distances"]

    def column(key):
        return np.array([np.nan if d.get(key) is None else d[key] for d in distances])

    return Design(Path(out) / f"{name}.yaml", column("distance_m"), column("least_sigma_m"), column("most_sigma_m"), content)


def as_built(robot, *, out, seed: int = 1, unmodelled: bool = False, force: bool = False) -> Path:
    """Draws a robot and a room as they are built, within tolerances, and returns the robot file that its builder believes.

    Its scene is the robot as built, so that a run of it shows what the belief misses. ``built.yaml`` beside it is the truth.

    :param robot: the plan: robot file of a simulated robot
    :param unmodelled: also what no model has
    """
    return _native.as_built(robot, out, _arguments.seed(seed), unmodelled, force)[0]


def scan(run, *, every: int = 1, clouds: bool = False, plan: bool = False) -> dict[str, int]:
    """Ranges everything that has texture in a run's images, and writes scan.csv into its folder. Returns what it counted."""
    return _native.scan(_one_folder(run), _arguments.whole("every", every, 1, 1_000_000), clouds, plan)


def tradeoff(robot, *, out, seed: int = 1, episodes: int = 28, fine: bool = False) -> Sweep:
    """Measures what accuracy costs in time. A sweep that ``out`` holds in part is continued."""
    episodes = _arguments.whole("episodes", episodes, 3, 1_000_000)
    content = json.loads(_native.tradeoff(robot, out, _arguments.seed(seed), episodes, fine))
    return Sweep(Path(out), content["settings"], content)


def compare(simulated, real, *, out, scene="", poses="") -> Comparison:
    """Compares a simulated with a real run, and names what makes them differ.

    :param simulated: None with ``scene``, the map whose scene is rendered at the real run's poses
    :param poses: TUM file of the real robot's poses from another system
    """
    if (simulated is None) != bool(scene):
        raise ValueError("compare() takes a simulated run, or None and the scene in which the real run's places are rendered")
    folder = _one_folder(real if simulated is None else simulated)
    content = json.loads(_native.compare(folder, _one_folder(real), out, scene, poses))
    differing = [source["name"] for source in content["sources"] if source["verdict"] == "differs"]
    return Comparison(Path(out), content["within_limits"], differing, content["rows"], content["gaps"], content["sources"],
                      content)


__all__ = ["Belief", "Calibration", "Comparison", "Design", "Parameter", "Survey", "Sweep", "as_built", "calibrate", "compare",
           "design", "scan", "survey", "tradeoff"]
