// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/calibrate/calibrate.h"
#include "apps/compare/comparison.h"
#include "apps/config/map_file.h"
#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "localisation/fix.h"
#include "localisation/odometry.h"
#include "vision/calibration.h"
#include "vision/image_quality.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"

/// Measurements from each of the two runs alone, and from both together.
namespace twocone::compare {

// ---- one run

/// One of the two runs, with the measurements of its robot from its own data. Ground truth enters only `reference`.
struct Side {
  std::string name;     ///< the folder, as the command named it
  runlog::RunData run;  ///< frames, wheels and poses; ranges and sightings are read where they are needed
  std::string method;   ///< method of the ranges and fixes that are compared; empty: those in the run folder itself
  /// Empty if the rig cannot be calibrated; then `why_no_calibration` states the reason.
  std::optional<calibrate::Report> calibration{};
  std::string why_no_calibration{};
  int chosen = 0;  ///< frames chosen for the calibration
  /// Shift of each landmark relative to the others, by name, for the landmarks in the calibration's frames.
  std::map<std::string, vision::RelativeShift> map_shifts{};
  std::vector<std::string> left_out{};  ///< data of the run that are not used, a sentence each
  vision::Rig believed;                 ///< `rig:` in the robot file
  vision::Rig found;                    ///< rig of the calibration; without one, the believed rig
  /// Pose of the robot at each frame.
  std::vector<std::optional<runlog::PoseRow>> reference{};
  std::string reference_is{};       ///< source of `reference`: truth, given trajectory, estimate
  bool is_reference_apart = false;  ///< whether the reference is independent of the run's own images
};

inline constexpr double kDegree = std::numbers::pi / 180;

/// Reads a run. @param poses file of a given trajectory (TUM format, the run's clock); empty: none
/// Errors: kBadData (the run cannot be compared, one line). @throws config::FileError as read_run, and if the run has
/// no sightings of method outline
Result<Side> read_side(const std::filesystem::path& folder, const std::filesystem::path& poses);

/// Calibrates the rig from the run's own data. The timing and the landmarks' places are among the unknowns.
/// @param frames number that the calibration uses. @param progress called with the fraction done; may be empty
void calibrate_side(Side& side, int frames, const std::function<void(double)>& progress);

/// Sums that give the mean and the root mean square of numbers.
struct Moments {
  std::size_t count = 0;
  double sum = 0, squares = 0;

  void add(double value) {
    ++count;
    sum += value;
    squares += value * value;
  }
  [[nodiscard]] std::optional<double> mean() const { return count ? std::optional(sum / double(count)) : std::nullopt; }
  [[nodiscard]] std::optional<double> rms() const {
    return count ? std::optional(std::sqrt(squares / double(count))) : std::nullopt;
  }
};

/// Differences between a run's answers and its reference, over all its frames.
struct Residuals {
  Moments range_m, bearing_rad, disparity_px;  ///< the run's own measurement minus the value at the reference pose
  Moments fix_m;                               ///< distance of fix and reference; none without an independent reference
  std::size_t frames = 0, with_fix = 0;
  std::size_t looked_for = 0, ranged = 0, outliers = 0;  ///< counts over all landmarks and frames
  std::vector<bool> has_range;                           ///< frame by frame, for each landmark of the map
  std::vector<ResidualPoint> points;                     ///< evenly spaced, at most kMostPoints
  static constexpr std::size_t kMostPoints = 3000;
};

/// Sets the references of a side that has neither truth nor a given trajectory. They are fixes from its sightings under
/// Side::found. @throws config::FileError as TableReader
void locate(Side& side);

/// Computes the residuals of all frames. @throws config::FileError as TableReader
Residuals residuals_of(const Side& side);

localisation::Pose pose_of(const runlog::PoseRow& row);

/// Returns the pose of a fix with verdict kOk, position and heading; otherwise nothing.
std::optional<runlog::PoseRow> pose_of(const localisation::Fix& fix, double t_s);

/// Triangulates a landmark from its sightings under `rig`. @param lower,upper nothing if that view has no sighting
vision::RangeMeasurement range_under(const vision::Rig& rig, const std::optional<vision::Sighting>& lower,
                                     const std::optional<vision::Sighting>& upper, const Landmark& target);

// ---- both runs: the times of their frames, the frames that correspond, the images

/// Returns why two maps cannot be of one room, for a message; empty if they can. Only the distances between landmarks
/// of the same name are compared. So the maps may have different origins, and one landmark may be moved or missing.
std::string why_other_rooms(const config::Map& a, const config::Map& b);

/// Returns the error of work that was stopped from outside.
inline Error stopped_error() {
  return {ErrorCode::kCancelled, "stopped from outside; the same command continues from here"};
}

/// Two corresponding frames of the two runs.
struct Match {
  std::size_t simulated = 0, real = 0;  ///< indices into the two lists
};

/// Returns, for each of `real`, the nearest one of `simulated` in time if they are at most `most_apart_s` apart. A
/// simulated frame may be matched more than once.
/// @param simulated,real times in ascending order
std::vector<Match> match_by_time(std::span<const double> simulated, std::span<const double> real, double most_apart_s);

/// Returns the distance of two poses as it changes images: a turn of one radian counts as one metre, because both move
/// the image of an object at a distance of one metre equally far.
double distance_m(const runlog::PoseRow& a, const runlog::PoseRow& b);

/// Returns, for each of `real`, the one of `simulated` at the smallest distance_m, if that is at most `most_apart_m`.
/// An unknown pose has no match.
std::vector<Match> match_by_pose(std::span<const std::optional<runlog::PoseRow>> simulated,
                                 std::span<const std::optional<runlog::PoseRow>> real, double most_apart_m);

/// Times of a run's frames, from their stamps.
struct Timing {
  double rate_hz = 0;   ///< inverse of the median time between consecutive frames without loss; 0: unknown
  double jitter_s = 0;  ///< root mean square deviation of those times from their median
  double skew_s = 0;    ///< mean of the stamped time of the upper view minus that of the lower one
  double skew_sigma_s = 0;
  double most_skew_s = 0;  ///< largest absolute skew
  /// Numbers of frames that were lost before or between those of the run, and of all frames; lower and upper camera.
  std::array<std::uint64_t, 2> lost{}, all{};
  /// Growth, over the run, of the delay from a frame's stamp to the host's clock. It is positive if images arrived
  /// later and later. Empty if the stamps are simulated time.
  std::optional<double> ageing_s{};
};

/// Computes the timing. @param run at least two frames
Timing timing_of(const runlog::RunData& run);

/// Returns the p-value of the exact two-sided binomial test: the probability of this number of losses or of a number
/// that is at most as probable, if each frame is lost with `probability`, in [0, 1].
double lost_p_value(std::uint64_t lost, std::uint64_t all, double probability);

/// Returns the p-value of Fisher's exact test, two-sided: the probability that two cameras with the same loss rate
/// differ at least so much.
double lost_p_value(std::uint64_t lost_a, std::uint64_t all_a, std::uint64_t lost_b, std::uint64_t all_b);

/// The two runs with their timing and the frames of both that correspond to each other.
struct BothRuns {
  const Side& simulated;
  const Side& real;
  Timing simulated_timing{}, real_timing{};
  std::vector<Match> by_time{}, by_pose{};
  bool is_rendered = false;  ///< whether render_again() made the simulated run
};

/// Interpolates linearly between the two `poses` around `t_s`; `poses` must be in order of time. Returns nothing before
/// the first pose, after the last one, and between two that are more than `longest_gap_s` apart.
std::optional<runlog::PoseRow> pose_at(std::span<const runlog::PoseRow> poses, double t_s,
                                       double longest_gap_s = INFINITY);

/// Measurements of the images of one view, for both runs.
struct ViewImages {
  vision::NoiseSamples simulated_noise, real_noise;
  std::vector<double> simulated_blur_px, real_blur_px;
  std::vector<vision::Transfer> transfers;  ///< of each pair of images from about the same place
};

struct Images {
  std::array<ViewImages, 2> views;      ///< lower, upper
  std::vector<std::string> unreadable;  ///< the first few unreadable images, each with the reason
  std::size_t unreadable_count = 0;
};

struct ImageWork {
  std::filesystem::path folder;  ///< stores finished parts, so that an interrupted comparison can continue
  std::string key;               ///< identifies the comparison; parts with another key are not used
  int every = 1;                 ///< step between the frames of the real run that are used, >= 1
  int jobs = 1;                  ///< number of threads, >= 1
  std::function<void(double)> progress;
  const std::atomic<bool>* stop = nullptr;  ///< another thread may set it; then no further part is started
};

/// Measures both runs' images in parts of kPartFrames real frames each. The parts are merged in order, so the result
/// does not depend on the number of jobs or on interruptions. Each job has the images of at most one real and one
/// simulated frame in memory.
/// @param by_pose pairs to compare; the simulated image is turned by the difference of the headings. A real frame
/// without a partner is not compared; it is measured alone, as is the simulated frame at the same fraction of the run
/// Errors: kCancelled (interrupted). @throws runlog::DiskError
Result<Images> measure_images(const Side& simulated, const Side& real, const std::vector<Match>& by_pose,
                              const ImageWork& work);
constexpr std::size_t kPartFrames = 25;

}  // namespace twocone::compare
