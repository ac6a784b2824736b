// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/compare/side.h"
#include "apps/config/map_file.h"
#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "vision/image_quality.h"

/// What is measured in both runs together: the times of their frames, the frames that correspond, the images.
namespace twocone::compare {

/// Returns why two maps cannot be of one room, for a message; empty if they can. The distances between landmarks of the
/// same name decide, so that another origin, one landmark that was moved or one that is missing make no difference.
std::string why_other_rooms(const config::Map& a, const config::Map& b);

/// Two corresponding frames of the two runs.
struct Match {
  std::size_t simulated = 0, real = 0;  ///< indices into the two lists
};

/// Returns for each of `real` the nearest one of `simulated` in time, if it is within `most_apart_s`. A simulated frame
/// may be matched more than once.
/// @param simulated,real times, rising
std::vector<Match> match_by_time(std::span<const double> simulated, std::span<const double> real, double most_apart_s);

/// Returns a distance of two poses for images: a turn of one radian counts as one metre, because it moves the image of
/// an object at one metre as far.
double distance_m(const runlog::PoseRow& a, const runlog::PoseRow& b);

/// Returns for each of `real` the one of `simulated` at the smallest distance_m, if it is within `most_apart_m`.
/// Unknown poses match nothing.
std::vector<Match> match_by_pose(std::span<const std::optional<runlog::PoseRow>> simulated,
                                 std::span<const std::optional<runlog::PoseRow>> real, double most_apart_m);

/// Times of a run's frames, from their stamps.
struct Timing {
  double rate_hz = 0;   ///< over the median time between consecutive frames without loss; 0: unknown
  double jitter_s = 0;  ///< standard deviation of those times
  double skew_s = 0;    ///< mean of the stamped time of the upper view minus that of the lower one
  double skew_sigma_s = 0;
  double most_skew_s = 0;  ///< largest absolute
  /// Frames of lower and upper that were lost before or between those of the run, and the number of all frames.
  std::array<std::uint64_t, 2> lost{}, all{};
  /// Growth of the delay between a stamp and the machine's clock over the run: images that came later and later. None
  /// where the stamps are simulated time.
  std::optional<double> ageing_s{};
};

/// @param run at least two frames
Timing timing_of(const runlog::RunData& run);

/// Returns the probability of this number of losses, or of one as improbable, where each frame is lost with
/// `probability`, in [0, 1]: the exact two-sided binomial test.
double lost_p_value(std::uint64_t lost, std::uint64_t all, double probability);

/// Returns the probability that two cameras with the same loss differ at least so much: Fisher's exact test, two-sided.
double lost_p_value(std::uint64_t lost_a, std::uint64_t all_a, std::uint64_t lost_b, std::uint64_t all_b);

/// The two runs with their timing and the frames of both that correspond to each other.
struct BothRuns {
  const Side& simulated;
  const Side& real;
  Timing simulated_timing{}, real_timing{};
  std::vector<Match> by_time{}, by_pose{};
  bool is_rendered = false;  ///< the simulated run was made by render_again()
};

/// Interpolates linearly between the two of `poses` around `t_s`; `poses` are in the order of their times. Returns
/// nothing before the first, after the last, and where the two are farther apart in time than `longest_gap_s`.
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
  std::vector<std::string> unreadable;  ///< unreadable images with the reason; the first few
  std::size_t unreadable_count = 0;
};

struct ImageWork {
  std::filesystem::path folder;  ///< finished parts are stored here, so that an interrupted comparison can continue
  std::string key;               ///< identifies the comparison: parts of another one are not used
  int every = 1;                 ///< every such frame of the real run is used, >= 1
  int jobs = 1;                  ///< threads, >= 1
  std::function<void(double)> progress;
  const std::atomic<bool>* stop = nullptr;  ///< set from outside: no further part is started
};

/// Measures both runs' images in parts of kPartFrames real frames each. The parts are merged in order, so the result
/// does not depend on the number of jobs or of interruptions. Only the images of one part per job are in memory.
/// @param by_pose pairs to compare; the simulated image is turned by the difference of the headings. A real frame
/// without a partner is measured alone, beside a simulated one at the same fraction of the run
/// Errors: kCancelled (interrupted). @throws runlog::DiskError
Result<Images> measure_images(const Side& simulated, const Side& real, const std::vector<Match>& by_pose,
                              const ImageWork& work);
constexpr std::size_t kPartFrames = 25;

}  // namespace twocone::compare
