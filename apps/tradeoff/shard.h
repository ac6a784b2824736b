// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
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
  int step = 0;  ///< number of the frame within the episode, 0 to kStepsOfEpisode - 1
  /// localisation::FixVerdict; for an answer from several frames, `ok` or `no_estimate`. Empty for the earlier frames
  /// of such an answer, of which only the times count.
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
/// Rows about images name the first setting of the plan that uses these images.
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
  std::vector<MemoryRow> render_memory;  ///< of the largest POV-Ray process, for each set of images
};

/// Renders the images of a shard and computes all answers from them.
/// @param progress called with the fraction of the shard that is done
/// Errors: those of sim_povray::Simulation and of images; kCancelled if `stop` was set
using RunShard = std::function<Result<ShardRecord>(std::size_t shard, const std::function<void(double)>& progress,
                                                   const std::atomic<bool>& stop)>;

/// Returns a function that runs shards. It keeps the world between shards of the same images, so the mirrors are
/// located and POV-Ray is started only once. Only one thread at a time may call it.
/// @param plan must outlive the function. @param render settings of POV-Ray, with its number of `processes`
RunShard shard_runner(const config::Robot& robot, const config::Map& map, const Plan& plan,
                      const sim_povray::RenderSettings& render);

/// A sweep on disk:
///
///     plan.yaml            settings, robot, map and version, so that shards of another sweep can be rejected
///     shards/NNNN/         a finished shard: frames.csv ranges.csv renders.csv memory.csv render_memory.csv
///     errors.csv           depends only on robot, map, options, seed and program, not on how the shards were run
///     tradeoff.csv         the same with times and frontiers
///     tradeoff.json        all of it, with the sentences
///     tradeoff.txt         the table and the conclusions
///     index.html           the page
///
/// A shard's folder is written under another name and then renamed, so it is either complete or absent. Several
/// programs, also on several machines, may write shards of one sweep at the same time.
class SweepFolder {
 public:
  /// Creates the folder, or continues one with the same plan.
  /// @throws config::FileError that names the difference if the folder contains another sweep's plan, or if the folder
  /// cannot be made; runlog::DiskError if plan.yaml cannot be written
  SweepFolder(std::filesystem::path folder, const config::Robot& robot, const config::Map& map, const Plan& plan);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  [[nodiscard]] bool has(std::size_t shard) const;
  /// Returns the shards of the plan that do not exist yet.
  [[nodiscard]] std::vector<std::size_t> missing() const;
  /// Writes a finished shard, unless another program has written it. @throws runlog::DiskError
  void add(std::size_t shard, const ShardRecord& record) const;
  /// Returns all shards in the plan's order. @throws config::FileError that names missing shards, or a line that is not
  /// a row
  [[nodiscard]] ShardRecord read_all() const;

 private:
  std::filesystem::path folder_;
  std::size_t shards_;
};

}  // namespace twocone::tradeoff
