// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/robot_file.h"
#include "base/plane.h"

/// Statistics of the fixes of very many stereo frames at independent poses. The frames are rendered by the native
/// renderer and are not stored.
namespace twocone::bench {

struct ManyFramesOptions {
  int frames = 2000;
  std::uint64_t seed = 1;
  std::optional<int> antialias{};  ///< rays per pixel side; empty: the robot file's
  int threads = 2;
  /// Receives a row for each frame, block by block. What a file of the same frames holds already is not computed again.
  /// Empty: the rows are not stored.
  std::filesystem::path rows{};
  std::function<void(int frames)> progress{};  ///< called after each block, from its thread
};

/// What one frame's fix is worth. A fix counts if it is a place (localisation::is_place): one of two positions would
/// be metres away, and alone would decide the mean.
struct FixRecord {
  int frame = 0;
  Pose2 truth{};
  std::string verdict;              ///< localisation::FixVerdict
  std::optional<double> error_m{};  ///< of a place
  std::optional<bool> in_ellipse{};
  std::optional<double> bound_m{};    ///< Cramer-Rao bound of the position
  double render_s = 0, vision_s = 0;  ///< processor time of the thread

  /// Compares all but the times.
  friend bool operator==(const FixRecord& a, const FixRecord& b) {
    return a.frame == b.frame && a.truth == b.truth && a.verdict == b.verdict && a.error_m == b.error_m &&
           a.in_ellipse == b.in_ellipse && a.bound_m == b.bound_m;
  }
};

/// Frames of one block share the noise of a landmark's outline that the bound assumes where a frame did not measure it
/// (runlog::bounds): the median over the block.
constexpr int kFramesOfBlock = 100;

/// Takes the frames. They depend on robot, map, scene, seed and anti-aliasing only, not on threads or interruptions.
/// @returns all records, in the order of the frames
/// @throws std::runtime_error, config::FileError: a scene that only POV-Ray renders; a robot whose images take time; a
/// file of rows of other frames
std::vector<FixRecord> take_frames(const config::Robot& robot, const ManyFramesOptions& options);

struct FixStatistics {
  int frames = 0, with_fix = 0;
  std::map<std::string, int> verdicts;
  double mean_m = 0, mean_half_width_m = 0;  ///< half of the 95 % interval
  double rmse_m = 0, max_m = 0;
  std::map<double, double> quantiles_m;  ///< by share
  int with_ellipse = 0, in_ellipse = 0;
  double coverage = 0, coverage_low = 0, coverage_high = 0;  ///< Wilson's 95 % interval
  /// Root mean squares over the frames that have a fix and a bound.
  int with_bound = 0;
  double bound_rms_m = 0, rmse_of_bounded_m = 0;
  double render_s = 0, vision_s = 0;  ///< processor time of a frame
};
FixStatistics statistics_of(const std::vector<FixRecord>& records);

}  // namespace twocone::bench
