// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/import/stamps.h"
#include "apps/runlog/run_data.h"
#include "localisation/odometry.h"

/// Reads the robot's motion from files of another program, on the clock of the images.
namespace twocone::importer {

/// A series of increasing times, with interpolation between them.
class Timeline {
 public:
  /// @param name of the file, for messages. @throws config::FileError for fewer than two times and for times that do
  /// not increase
  Timeline(std::vector<Stamp> times, const std::string& name);

  struct Place {
    std::size_t before = 0;  ///< index of the last time that is not later
    double share = 0;        ///< fraction of the way to the next time, 0 to 1
  };
  /// Returns nothing before the first and after the last time, with a tolerance of half a millisecond for rounded
  /// times. Returns nothing in a gap, where neighbours are more than a second and more than five median periods apart.
  [[nodiscard]] std::optional<Place> find(Stamp time) const;

  [[nodiscard]] Stamp first() const { return times_.front(); }
  [[nodiscard]] Stamp last() const { return times_.back(); }

 private:
  std::vector<Stamp> times_;
  Stamp widest_{};
};

/// The true poses of the robot: a file in TUM format (t tx ty tz qx qy qz qw), for example of a motion capture system.
class Trajectory {
 public:
  /// @throws config::FileError
  explicit Trajectory(const std::filesystem::path& file);

  /// Interpolates linearly between the two poses around `time`, the heading by the shorter way. t_s is 0. Returns
  /// nothing outside the timeline.
  [[nodiscard]] std::optional<runlog::PoseRow> at(Stamp time) const;
  [[nodiscard]] const Timeline& timeline() const { return timeline_; }

 private:
  std::vector<runlog::PoseRow> poses_;
  Timeline timeline_;
};

/// The wheel angles that drive from one pose to the next on exact arcs (localisation::Odometry, inverted), starting at
/// 0. T is the turn between two headings, by the shorter way. c and e are the components of the step along and across
/// the direction halfway:
///
///     D = c / sinc(T/2),   left += (D - T b/2) / r,   right += (D + T b/2) / r.
///
/// Wheels cannot move sideways, so e is left out and reported.
struct WheelsOfPoses {
  std::vector<localisation::WheelTurns> turns;  ///< one per pose
  double path_m = 0;                            ///< sum of |D|
  double sideways_m = 0;                        ///< sum of |e|
};
WheelsOfPoses wheels_of(const std::vector<localisation::Pose>& poses, const localisation::WheelGeometry& wheels);

/// The wheel angles from a CSV file with a header line. The columns may be in any order and among others: t_s,
/// left_rad, right_rad (the total angle of each wheel), or t_s, x_m, y_m, heading_rad (if the robot records only its
/// own dead reckoning).
class WheelFile {
 public:
  /// @throws config::FileError that names the line
  WheelFile(const std::filesystem::path& file, const localisation::WheelGeometry& wheels);

  /// Interpolates between the two readings around `time`, as if the wheels had turned at constant speed. Returns
  /// nothing outside the timeline.
  [[nodiscard]] std::optional<localisation::WheelTurns> at(Stamp time) const;
  [[nodiscard]] const Timeline& timeline() const { return *timeline_; }
  /// Returns notes for the user, one sentence each.
  [[nodiscard]] const std::vector<std::string>& events() const { return events_; }

 private:
  std::vector<localisation::WheelTurns> turns_;
  std::optional<Timeline> timeline_;
  std::vector<std::string> events_;
};

}  // namespace twocone::importer
