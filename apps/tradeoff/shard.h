// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/plan.h"
#include "drivers/sim_povray/place.h"
#include "hal/result.h"

namespace twocone::tradeoff {

/// The answer of one setting for one frame of one episode. Everything except the times is a function of the plan.
struct FrameRow {
  int setting = 0;  ///< index in Plan::settings
  int episode = 0;
  int step = 0;  ///< within the episode, 0 to kStepsOfEpisode - 1; for several frames together, the last one's
  /// localisation::FixVerdict, or `no_estimate` of the filter. Empty for an intermediate frame of an answer from
  /// several frames, of which only the times count.
  std::string verdict{};
  std::optional<double> error_m{}, heading_error_rad{};  ///< absolute; none without exactly one position
  std::optional<bool> in_ellipse{};                      ///< none without a covariance
  std::optional<double> bound_m{};
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
  double peak_bytes = 0;
};

/// The results of a shard.
struct ShardRecord {
  std::vector<FrameRow> frames;
  std::vector<RangeRow> ranges;
  std::vector<RenderRow> renders;
  std::vector<MemoryRow> memory;         ///< resident memory of the program, with one pair of images
  std::vector<MemoryRow> render_memory;  ///< of the largest POV-Ray process, by images
};

/// Renders the images of a shard and computes all answers from them. Errors: those of sim_povray::Simulation and of
/// images; kCancelled if `stop` was set. @param progress called with the fraction of the shard that is done
using RunShard = std::function<Result<ShardRecord>(std::size_t shard, const std::function<void(double)>& progress,
                                                   const std::atomic<bool>& stop)>;

/// Returns a function that keeps the world between shards of the same images, so that the mirrors are located and
/// POV-Ray is started once. For one thread at a time.
/// @param plan must outlive the function. @param render settings of POV-Ray, with its number of `processes`
RunShard shard_runner(const config::Robot& robot, const config::Map& map, const Plan& plan,
                      const sim_povray::RenderSettings& render);

}  // namespace twocone::tradeoff
