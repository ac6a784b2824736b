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
#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"

namespace twocone::tradeoff {

/// What one setting made of one frame of one leg. All but the times is a function of the plan.
struct FrameRow {
  int setting = 0;  ///< index in Plan::settings
  int leg = 0;
  int instant = 0;  ///< of the leg, 0 to kInstants - 1; of several frames together, the last one's
  /// localisation::FixVerdict, or `no_estimate` of the filter; empty for a frame on the way to an answer of several,
  /// which counts for its times alone.
  std::string verdict;
  std::optional<double> error_m, heading_error_rad;  ///< absolute; none without exactly one position
  std::optional<bool> in_ellipse;                    ///< none without a covariance
  std::optional<double> bound_m;
  double vision_s = 0, localisation_s = 0;  ///< processor time
};
struct RangeRow {
  int setting = 0, leg = 0, instant = 0;
  double error_m = 0;  ///< absolute
};
/// Rows of pictures name the first setting of the plan that is made of such pictures.
struct RenderRow {
  int setting = 0, leg = 0, instant = 0;
  double cpu_s = 0;  ///< of both pictures
};
struct MemoryRow {
  int setting = 0;
  double peak_bytes = 0;  ///< resident, with one pair of pictures
};
struct RenderMemoryRow {
  int setting = 0;
  double peak_bytes = 0;  ///< of the largest POV-Ray process
};

/// What came of a shard.
struct ShardRecord {
  std::vector<FrameRow> frames;
  std::vector<RangeRow> ranges;
  std::vector<RenderRow> renders;
  std::vector<MemoryRow> memory;
  std::vector<RenderMemoryRow> render_memory;
};

/// Renders pictures and makes all answers of them. Keeps the world between shards of the same pictures, so that finding
/// the mirrors and starting POV-Ray is done once. One thread at a time.
class ShardRunner {
 public:
  /// @param render how; `processes` of it
  ShardRunner(files::Robot robot, files::Map map, const Plan& plan, sim_povray::RenderSettings render);
  ~ShardRunner();
  ShardRunner(const ShardRunner&) = delete;
  ShardRunner& operator=(const ShardRunner&) = delete;

  /// Errors: those of sim_povray::Simulation and of pictures; kRefused when `stop` was set.
  /// @param progress told the share of the shard that is done
  Result<ShardRecord> run(std::size_t shard, const std::function<void(double)>& progress,
                          const std::atomic<bool>& stop);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::tradeoff
