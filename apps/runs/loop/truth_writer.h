// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_folder.h"
#include "drivers/backends.h"
#include "drivers/sim_povray/reflected_truth.h"

namespace twocone::runs {

/// Writes what each mirror pixel really shows (run --truth), as CSV beside the images.
class TruthWriter {
 public:
  /// Errors: kRefused (no simulated world inside this program), and those of sim_povray::claimed_object
  static Result<TruthWriter> open(const config::Robot& robot, const config::Map& map,
                                  const drivers::RobotSettings& settings);

  /// Errors: those of sim_povray::reflected_truth. @throws runlog::DiskError
  [[nodiscard]] Status write(const std::filesystem::path& run, const runlog::FrameRecord& record,
                             const StereoFrame& frame) const;

 private:
  TruthWriter() = default;

  const config::Robot* robot_ = nullptr;
  sim_povray::PlaceSettings place_;
  std::string object_;
  std::string ending_;  ///< of its cameras' names
  std::vector<Landmark> landmarks_;
};

}  // namespace twocone::runs
