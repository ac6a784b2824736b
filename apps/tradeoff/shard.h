// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/plan.h"
#include "drivers/sim_povray/render_settings.h"
#include "hal/result.h"

namespace twocone::tradeoff {

/// The answer of one setting for one frame of one episode. Everything except the times is a function of the plan.
struct FrameRow {
  int setting = 0;  ///< index in Plan::settings
  int episode = 0;
  int step = 0;  ///< within the episode, 0 to kStepsOfEpisode - 1; for several frames together, the last one's
  /// localisation::FixVerdict, or `no_estimate` of the filter. Empty for an intermediate frame of an answer from
  /// several frames, of which only the times count.
  std::string verdict;
  std::optional<double> error_m, heading_error_rad;  ///< absolute; none without exactly one position
  std::optional<bool> in_ellipse;                    ///< none without a covariance
  std::optional<double> bound_m;
  double vision_s = 0, localisation_s = 0;  ///< processor time
};
struct RangeRow {
  int setting = 0, episode = 0, step = 0;
  double error_m = 0;  ///< absolute
};
/// Rows of images name the first setting of the plan that uses these images.
struct RenderRow {
  int setting = 0, episode = 0, step = 0;
  double cpu_s = 0;  ///< of both images
};
struct MemoryRow {
  int setting = 0;
  double peak_bytes = 0;  ///< resident memory, with one pair of images
};
struct RenderMemoryRow {
  int setting = 0;
  double peak_bytes = 0;  ///< of the largest POV-Ray process
};

/// The results of a shard.
struct ShardRecord {
  std::vector<FrameRow> frames;
  std::vector<RangeRow> ranges;
  std::vector<RenderRow> renders;
  std::vector<MemoryRow> memory;
  std::vector<RenderMemoryRow> render_memory;
};

/// Renders images and computes all answers from them. Keeps the world between shards of the same images, so that the
/// mirrors are located and POV-Ray is started once. For one thread at a time.
class ShardRunner {
 public:
  /// @param render settings of POV-Ray, with its number of `processes`
  ShardRunner(config::Robot robot, config::Map map, const Plan& plan, sim_povray::RenderSettings render);
  ~ShardRunner();
  ShardRunner(const ShardRunner&) = delete;
  ShardRunner& operator=(const ShardRunner&) = delete;

  /// Errors: those of sim_povray::Simulation and of images; kCancelled if `stop` was set.
  /// @param progress called with the fraction of the shard that is done
  Result<ShardRecord> run(std::size_t shard, const std::function<void(double)>& progress,
                          const std::atomic<bool>& stop);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::tradeoff
