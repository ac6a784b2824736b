// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/estimator.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "drivers/backends.h"

namespace twocone::runs {

/// Told how much is done, 0 to 1.
using Progress = std::function<void(double done)>;

struct RunOptions {
  int frames = 450;                  ///< >= 1; 30 s at 15 frames per second, as in the paper
  std::string behaviour = "wander";  ///< wander, waypoints, still
  estimation::Method method = estimation::kDefaultMethod;
  std::uint64_t seed = 1;
  std::filesystem::path out;  ///< the run folder to make
  /// kKeep: `out` holds an equal run that was cut off (resume()): it is driven again from the start with the images
  /// that are there, and goes on where they end.
  runlog::OldLines old = runlog::OldLines::kDrop;
  bool replace = false;  ///< a run that is in `out` goes (locked_folder.h) once the robot has been opened
  bool truth = false;    ///< in a world of its own: also what each mirror pixel really shows (runlog::write_truth)
  /// Of devices, not of a simulation: how long a failure is put up with, the wheels at rest; 0: not at all.
  std::chrono::milliseconds patience{10'000};
  std::function<void(const std::string&)> notify{};  ///< gets each of RunInfo::events at once; may be empty
  /// Makes the robot of its parts.
  std::function<Result<Robot>(const drivers::RobotSettings&)> open = drivers::open_robot;
};

/// Drives a robot and writes its run folder (docs/file-formats.md).
///
/// The loop is the same in simulation and on hardware: take the next frame; look at the frame of `latency_frames` ago,
/// whose pixels are there by then; steer by odometry corrected by that frame's fix. So what is decided does not depend
/// on how fast images come. The true pose goes into the tables and nowhere else.
///
/// Ranges and fixes are made as `robot.estimator` says, but by `options.method`; run.yaml keeps both.
///
/// Method `paper` also answers from the same images, into methods/paper/, as the baseline. Where its formulas do not
/// hold for the mirrors, run.yaml states that there is no baseline.
///
/// The folder is locked from the start, and goes again if the run ends before its first frame.
///
/// When a device fails, the wheels stop, and it is asked again until it answers (FaultPolicy); a simulation is not
/// asked again. A failure that lasts ends the run: what was written stays readable, and the message names the frame.
/// @param robot,map as read from their files. @param stop set from outside (a signal) ends the run after the present
/// frame
/// @returns run.yaml's contents. @throws config::FileError, DiskError, std::invalid_argument (no such behaviour, no
/// waypoints) Errors: those of drivers::open_robot, Robot::next_frame, Frame::image, DiffDrive; kRefused when stopped
/// from outside
Result<runlog::RunInfo> run(const config::Robot& robot, const config::Map& map, const RunOptions& options,
                            const Progress& progress, const std::atomic<bool>& stop);

/// Why resume() would refuse the run, as far as is known before it is driven; empty: it would not.
/// @throws config::FileError for a folder that is no run
std::string why_not_resumed(const std::filesystem::path& folder);

/// Goes on with a simulated run that was interrupted or killed, so that its tables and images become those of an
/// unbroken one: the world is driven again from the start, which costs little, and the images that are there are looked
/// at in place of rendered ones. Every row that is there must come out again; a run whose tables say otherwise is
/// refused. No table is ever shorter than before, also when this is killed in its turn.
///
/// timing.csv and the last column of frames.csv tell what the machine did, and are not repeated.
/// @param options only `tell` and `open` count; the rest is the run's own
/// @returns as run(). @throws config::FileError: cannot be gone on with, and the reason: it is finished; its robot is
/// real, imported or in a served world; it had a time budget, so that the clock took part; another version of the
/// program made it; its robot file, map or scene has changed since, and what of it. DiskError. Errors: as run()
Result<runlog::RunInfo> resume(const std::filesystem::path& folder, const RunOptions& options, const Progress& progress,
                               const std::atomic<bool>& stop);

struct LocaliseOptions {
  /// Whether a frame that has lost an image, or has one that cannot be read, gets verdict `no_image` and no answer;
  /// otherwise it is named, and nothing is changed.
  bool allow_missing = false;
  const std::atomic<bool>* stop = nullptr;  ///< set from outside (a signal): ends the work, and changes nothing
};

/// Ranges and fixes again from the stored frames, with the `estimator:` that run.yaml keeps, into methods/NAME/ and the
/// top of the run folder: all of it, or, where anything fails, none. Holds the folder's lock.
/// @returns the run with the new results. @throws config::FileError (also for a run without frames), DiskError (also
/// where another program writes into the folder). Errors: kNotFound, kBadData (images, by name), kRefused (stopped)
Result<runlog::RunData> localise(const std::filesystem::path& folder, estimation::Method method,
                                 const Progress& progress, const LocaliseOptions& options = {});

/// A new run folder with what `from` recorded (images, wheel angles, truth), as the robot of another file would have
/// it: for localise() to range and fix with that file's `rig:` and wheels, after a calibration say. `from` stays as it
/// is.
///
/// Images are hard links where the disk supports them, otherwise copies. The odometry is computed again from the
/// recorded angles. run.yaml is `from`'s with the other robot in it, and an event that says so; the map is still
/// `from`'s, so a file that names a map with other landmarks or bounds is refused.
/// @param from also a run that was cut off
/// @param robot_file of the same cameras' sizes and the same start, or it cannot have been that robot
/// @param to a folder without a run; `replace`: one that is there goes (locked_folder.h). A failure leaves none
/// @throws config::FileError (a file that cannot be read, another robot altogether), DiskError
void copy_run_for_robot(const std::filesystem::path& from, const std::filesystem::path& robot_file,
                        const std::filesystem::path& to, bool replace = false);

}  // namespace twocone::runs
