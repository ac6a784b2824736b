# SPDX-License-Identifier: Apache-2.0
"""Run folders as arrays."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twocone import _arguments, _native
from twocone.errors import FileError

#: A table: its columns by name. Numbers are float64 with nan for empty fields, texts are str. pandas.DataFrame(table) takes it.
Table = dict[str, np.ndarray]


@dataclass(frozen=True)
class Run:
    """A run folder (docs/file-formats.md). Poses are arrays of rows ``t_s, x_m, y_m, heading_rad``."""

    folder: Path
    method: str
    robot_file: Path
    map_file: Path
    summary: dict  #: as summary.json
    events: list[str]
    frames: Table
    drive: Table
    ranges: Table
    fixes: Table
    sightings: Table
    timing: Table
    track: Table
    truth: np.ndarray
    odometry: np.ndarray
    estimate: np.ndarray

    def image_files(self, frame: int) -> tuple[Path, Path]:
        """Returns the files of a frame's images, lower and upper."""
        name = f"{frame:06d}.png"
        return self.folder / "lower" / name, self.folder / "upper" / name


def read_run(folder, method: str = "") -> Run:
    """Reads a run, also one that was cut off or is being written.

    :param method: of ``methods/NAME``; empty: the results at the top of the folder
    :raises twocone.FileError: naming file and line
    """
    content = _native.read_run(folder, method)
    content["summary"] = json.loads(content["summary"])
    return Run(**content)


def run(robot, *, out, behaviour="wander", frames: int = 450, method: str = "", seed: int = 1, changes: dict | None = None,
        renderer: str = "", landmarks: bool = True, real_time: bool = False, truth: bool = False, telemetry: bool = False,
        progress=None, force: bool = False) -> Run:
    """Drives a robot, ranges its landmarks, finds its position, writes a run folder, and returns it.

    :param out: run folder to make
    :param behaviour: ``wander``, ``waypoints``, ``explore``, ``still``, or a function ``(pose, step_s) -> Velocity`` (or a
        pair of forward_mps and turn_radps) that is called once per frame with the pose that the robot believes
    :param changes: keys of the robot file with other values, such as ``{"effects.camera.read_noise_electrons": 12}``
    :param landmarks: False: start without the map's landmarks, and find them on the way
    :param progress: called with the fraction that is done
    :raises twocone.FileError, twocone.DeviceError: as the command ``twocone run``
    """
    frames = _arguments.whole("frames", frames, 1, 100_000_000)
    seed = _arguments.seed(seed)
    words = [f"{key}={json.dumps(value)}" for key, value in (changes or {}).items()]
    controller = None
    if callable(behaviour):
        decide = behaviour

        def controller(pose, step_s):
            velocity = decide(pose, step_s)
            return (velocity.forward_mps, velocity.turn_radps) if isinstance(velocity, _native.Velocity) else velocity

        behaviour = "controller"
    else:
        _arguments.one_of("behaviour", behaviour, ("wander", "waypoints", "explore", "still"))
    _native.run(robot, out, words, behaviour, controller, frames, method, seed, renderer, landmarks, real_time, truth,
                telemetry, progress, force)
    return read_run(out)


def localise(folder, *, method: str = "", allow_missing: bool = False) -> Run:
    """Computes ranges and fixes again from a run's stored frames, and returns the run with them.

    :param method: ``paper`` or ``outline``; empty: that of the run
    :param allow_missing: frames that have lost an image get the verdict ``no_image``; otherwise they are an error
    """
    folder = folder.folder if isinstance(folder, Run) else folder
    _native.localise(folder, method, allow_missing)
    return read_run(folder)


def shipped(name: str) -> Path:
    """Returns a file that comes with the program, such as ``robots/lab_sim.yaml``: of the present folder, else the program's.

    :raises twocone.FileError: if there is none
    """
    above = Path(__file__).resolve().parents
    # PREFIX/lib/python3/dist-packages/twocone/runs.py, or python/twocone/runs.py of the source.
    folders = [Path(), *(folder / "share/twocone" for folder in above[4:5]), above[2]]
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    raise FileError(f"{name}: is in none of {', '.join(str(folder.absolute()) for folder in folders)}")
