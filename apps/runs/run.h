// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/behaviours/behaviour.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/estimator.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runs/remote_control.h"
#include "drivers/backends.h"
#include "hal/image.h"

namespace twocone::runs {

/// Receives the fraction that is done, 0 to 1.
using Progress = std::function<void(double done)>;

/// A frame with everything that is stored about it.
struct FinishedFrame {
  runlog::FrameRecord record;
  std::shared_ptr<const Image> lower, upper;
  std::vector<runlog::OtherImage> others{};
  std::vector<runlog::CameraTruth> truth{};  ///< run --truth
};

/// Figures of a finished frame that exist only while the run is being driven.
struct LiveFigures {
  double age_s = 0;                  ///< from the frame's arrival to its answer
  std::optional<int> late_frames{};  ///< that began late so far; with RunOptions::real_time
};

struct RunOptions {
  int frames = 450;                  ///< >= 1; 30 s at 15 frames per second, as in the paper
  std::string behaviour = "wander";  ///< wander, waypoints, explore, still, manual, controller
  /// Decides how to drive, on the run's thread; for behaviour `controller`. Such a run cannot be repeated without it.
  behaviours::Controlled::Decide controller{};
  estimation::Method method = estimation::kDefaultMethod;
  std::uint64_t seed = 1;
  std::filesystem::path out;  ///< the run folder to make
  /// kKeep: `out` holds an equal run that was cut off (resume()). That run is driven again from the start with the
  /// stored images, and continues after the last of them.
  runlog::OldLines old = runlog::OldLines::kDrop;
  bool replace = false;  ///< a run in `out` is removed (locked_folder.h) after the robot has been opened
  /// The renderer of a simulation; none: the map's.
  std::optional<sim_povray::RendererKind> renderer{};
  std::string rendered_before{};  ///< RunInfo::renderer of a run that is resumed
  bool maps = false;       ///< the map's landmarks are not used: they are found on the way (estimation/mapping.h)
  bool real_time = false;  ///< paces the simulated world by the wall clock; an event states how many frames were late
  bool truth = false;      ///< also stores what each pixel shows (runlog::write_truth); needs the native renderer
  /// Devices only: the time for which a failing device is tried again, with the wheels stopped. 0: no second try.
  std::chrono::milliseconds patience{10'000};
  std::function<void(const std::string&)> notify{};  ///< receives each of RunInfo::events at once; may be empty
  bool telemetry = false;                            ///< also writes telemetry.jsonl (docs/telemetry.md)
  /// Requests of a person, while the robot drives; null: there are none. Such a run cannot be repeated.
  const RemoteControl* remote = nullptr;
  /// Receives the content of run.yaml when the folder has been made, and then each finished frame. The run's thread
  /// calls them and waits for them. May be empty.
  std::function<void(const runlog::RunInfo&)> opened{};
  std::function<void(const FinishedFrame&, const LiveFigures&)> finished{};
  /// Opens the robot from its parts.
  std::function<Result<Robot>(const drivers::RobotSettings&)> open = drivers::open_robot;
};

/// Drives a robot and writes its run folder (docs/file-formats.md).
///
/// The loop is the same in simulation and on hardware. It takes the next frame, computes the fix of the frame that was
/// taken `latency_frames` earlier, whose pixels have arrived by then, and steers by odometry that this fix has
/// corrected. Decisions therefore do not depend on how fast images arrive. Where time passes between the frames (real
/// devices, `real_time`), fixes are computed as soon as the images are there. The true pose is used only for the
/// tables.
///
/// Ranges and fixes follow `robot.estimator`, except that the method is `options.method`. run.yaml records both.
///
/// Method `paper` also computes answers from the same images, in methods/paper/, as the baseline. If its formulas do
/// not hold for the mirrors, run.yaml states that there is no baseline.
///
/// The folder is created and locked after the robot has been opened. It is removed if the run ends before its first
/// frame.
///
/// When a device fails, the wheels stop, and the device is tried again until it answers (FaultPolicy). A simulation is
/// not tried again. A failure that lasts ends the run. Its files stay readable, and the message names the frame.
/// @param robot,map as read from their files
/// @param stop set from outside (by a signal); the run then ends after the present frame
/// @returns the content of run.yaml. Errors: those of drivers::open_robot, Robot::next_frame, Frame::image, DiffDrive,
/// compare_start(); kRefused: `truth` of a real robot or of another renderer, `real_time` of a real robot; kCancelled:
/// stopped from outside
/// @throws config::FileError (also for no waypoints), DiskError, std::invalid_argument (frames < 1, no such behaviour)
Result<runlog::RunInfo> run(const config::Robot& robot, const config::Map& map, const RunOptions& options,
                            const Progress& progress, const std::atomic<bool>& stop);

/// Returns why resume() would reject the run, as far as this is known before the run is driven. Empty: no reason.
/// @throws config::FileError for a folder that is no run
std::string why_not_resumed(const std::filesystem::path& folder);

/// Continues a simulated run that was interrupted or killed. Its tables and images then equal those of an uninterrupted
/// run. The world is driven again from the start, which costs little, and the stored images are used in place of
/// rendered ones. Every stored row must be computed again with the same result. Otherwise the run is rejected
/// (DiskError). No table ever becomes shorter, even if this call is killed too.
///
/// timing.csv and the last column of frames.csv depend on the machine and are not reproduced.
/// @param options provides `notify`, `open` and `patience`; the rest is the run's own
/// @returns as run(). Errors: as run()
/// @throws config::FileError with the reason why the run cannot be continued: it is finished; its robot is real,
/// imported or in a served world; it had a time budget, so the clock took part; another version of the program made it;
/// its robot file, map or scene has changed since (the message names the change). DiskError
Result<runlog::RunInfo> resume(const std::filesystem::path& folder, const RunOptions& options, const Progress& progress,
                               const std::atomic<bool>& stop);

struct LocaliseOptions {
  /// true: a frame without a readable pair of images gets verdict `no_image` and no answer. false: it is an error, and
  /// nothing is changed.
  bool allow_missing = false;
  /// Ends the work when it is set from outside (by a signal). Nothing is changed then.
  const std::atomic<bool>* stop = nullptr;
};

/// Computes ranges and fixes again from the stored frames, with the `estimator:` in run.yaml. Writes all of them into
/// methods/NAME/ and the top of the run folder, or none if anything fails. Holds the folder's lock.
/// @returns the run with the new results. Errors: kNotFound, kBadData (images, by name), kCancelled (stopped)
/// @throws config::FileError (also for a run without frames), DiskError (also if another program writes into the
/// folder)
Result<runlog::RunData> localise(const std::filesystem::path& folder, estimation::Method method,
                                 const Progress& progress, const LocaliseOptions& options = {});

/// Makes a new run folder from the recorded data of `from` (images, wheel angles, truth), as a robot with other beliefs
/// would have recorded them. localise() can then compute ranges and fixes with these, for example with the robot and
/// the map of a calibration. `from` is not changed.
///
/// Images are hard links if the disk supports them, otherwise copies. The odometry is computed again from the
/// recorded angles. run.yaml is that of `from` with what is other and an event that reports it.
/// @param from may be a run that was cut off
/// @param other a robot file must have the same image sizes and the same start, otherwise it cannot have been that
/// robot. Without a map file, the map that the robot file names is used; its landmarks must have the names of the
/// run's, otherwise it is another room. A map file may have any landmarks.
/// @param to a folder without a run; with `replace`, a run there is removed (locked_folder.h). A failure leaves none
/// @throws config::FileError (a file that cannot be read, another robot or room altogether), DiskError
void copy_run_with(const runlog::OtherBeliefs& other, const std::filesystem::path& from,
                   const std::filesystem::path& to, bool replace = false);

}  // namespace twocone::runs
