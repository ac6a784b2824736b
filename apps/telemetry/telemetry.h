// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "vision/beam.h"
#include "vision/mirror_view.h"

/// The lines of docs/telemetry.md.
namespace twocone::telemetry {

/// The schema's name and version, in the first line.
inline constexpr const char* kSchema = "twocone.telemetry/1";

/// Which of its answers a robot can have at all.
struct Sensors {
  bool images = true;
  bool odometry = true;
  bool truth = false;  ///< simulation
  bool fixes = true;   ///< a map lists landmarks
  bool skew = false;   ///< real cameras
};

/// Returns the map as it stands in the first line.
nlohmann::ordered_json map_of(const config::Map& map);

/// Returns what a robot has that is being driven. @param maps its landmarks are found on the way
Sensors sensors_of(const config::Robot& robot, bool maps);

/// Makes the lines of one run.
class Lines {
 public:
  /// @param map as the run uses it: without landmarks where they are found on the way
  Lines(const config::Robot& robot, const config::Map& map);

  /// Returns the first line, without `live`. @param name of the run's folder
  [[nodiscard]] nlohmann::ordered_json run(const std::string& name, const runlog::RunInfo& info,
                                           const Sensors& sensors) const;

  /// Returns the line of a frame, without `age_s` and `late_frames`.
  [[nodiscard]] nlohmann::ordered_json frame(const runlog::FrameRecord& record) const;

 private:
  config::Robot robot_;
  config::Map map_;
  std::optional<vision::Rig> rig_;  ///< nothing: the robot file's numbers make no rig
};

/// Returns the outline of an upright cylinder in a view: up one side, over the near rim of its top, down the other
/// side. What the mirror does not show is left out. @param p_BL_m its axis, body frame. @param top_m over the floor
std::vector<Eigen::Vector2d> outline_px(const vision::MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m,
                                        double top_m);

/// A run folder, frame by frame.
class StoredRun {
 public:
  /// Reads the run with all its tables. @throws config::FileError as runlog::read_run
  explicit StoredRun(const std::filesystem::path& folder);
  /// @param run must outlive this object
  explicit StoredRun(const runlog::RunData& run);

  StoredRun(const StoredRun&) = delete;
  StoredRun& operator=(const StoredRun&) = delete;

  [[nodiscard]] const runlog::RunData& data() const { return *run_; }
  [[nodiscard]] std::size_t size() const { return run_->frames.size(); }
  /// Returns the first line.
  [[nodiscard]] nlohmann::ordered_json run() const;
  /// Returns the line of the frame in that row, < size().
  [[nodiscard]] nlohmann::ordered_json frame(std::size_t row) const;
  /// Returns the rows that this frame has in the tables.
  [[nodiscard]] runlog::FrameRecord record(std::size_t row) const;

 private:
  void index();

  std::optional<runlog::RunData> own_;
  const runlog::RunData* run_;
  std::vector<runlog::LandmarkRow> landmarks_;
  std::map<std::uint64_t, std::vector<vision::Beam>> scans_;  ///< by frame
  std::vector<std::optional<runlog::PoseRow>> truth_, odometry_;
  std::optional<Lines> lines_;
};

/// What a stored page embeds of a run: `run`, `frames`, `images` (by frame number, `lower` and `upper` as data URIs of
/// JPEG images 320 pixels wide) and `every`: only each such frame is there. A run of up to kMostFrames has all, a
/// longer one at most kMostOfLongRun, because its page also holds the columns of all frames.
constexpr std::size_t kMostFrames = 450;
constexpr std::size_t kMostOfLongRun = 300;
nlohmann::ordered_json embedded(const StoredRun& run);

}  // namespace twocone::telemetry
