// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/mcap/mcap.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "vision/beam.h"
#include "vision/mirror_view.h"

namespace twocone::recording {

/// A message of a run, for any container or stream.
struct RunMessage {
  std::string topic;
  const mcap::Schema& schema;  ///< the same object for all messages of that schema, until the program ends
  std::string_view encoding;   ///< protobuf or json
  double t_s;                  ///< since the run's first frame, >= 0
  std::string bytes;
};

/// A topic that a run may have.
struct RunTopic {
  std::string name;
  const mcap::Schema& schema;  ///< as in RunMessage
  std::string_view encoding;
};
/// Returns all of them.
std::vector<RunTopic> topics_of_runs();

/// Returns a time of a run in nanoseconds.
std::uint64_t to_ns(double t_s);

/// What a run says, as messages (docs/recordings.md).
class RunMessages {
 public:
  using Emit = std::function<void(const RunMessage&)>;
  /// @param map as the run uses it: without landmarks where they are found on the way
  /// @param emit receives each message
  RunMessages(const config::Robot& robot, const config::Map& map, Emit emit);

  /// The messages of the whole run: landmarks of the map, where the lenses are. @param first_line of docs/telemetry.md
  void begin(const std::string& first_line) const;
  void event(double t_s, const std::string& text, bool is_warning = false) const;
  /// @param format png or jpeg. @param content of a file of that format
  void image(vision::Side side, double t_s, const std::string& format, std::string content) const;
  /// The messages of a frame, without its images. @param line of docs/telemetry.md
  void frame(const runlog::FrameRecord& record, bool has_odometry, const std::string& line) const;

 private:
  template <typename Message>
  void add(const std::string& topic, double t_s, const Message& message) const;
  void add_line(double t_s, const std::string& line) const;
  void add_lens(vision::Side side, double t_s) const;
  void add_pose(const std::string& topic, double t_s, const runlog::PoseRow& pose) const;
  void add_track(double t_s, const runlog::TrackRow& track) const;
  void add_scan(double t_s, const std::vector<vision::Beam>& beams) const;

  config::Robot robot_;
  config::Map map_;
  std::optional<vision::Rig> rig_;  ///< nothing: the robot file's numbers make no rig
  Emit emit_;
};

}  // namespace twocone::recording
