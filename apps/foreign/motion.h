// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/foreign/stamps.h"
#include "apps/runs/run_data.h"
#include "localisation/odometry.h"

/// How the robot moved, as files of another program tell it; on the clock of the pictures.
namespace twocone::foreign {

/// Rising times at which something is known, and what lies between them.
class Timeline {
 public:
  /// @param name of the file, for messages. @throws files::FileError for fewer than two times and for one that does not
  /// rise
  Timeline(std::vector<Stamp> times, const std::string& name);

  struct Place {
    std::size_t before = 0;  ///< the time after it is the next one
    double share = 0;        ///< of the way to the next, 0 to 1
  };
  /// Nothing before the first and after the last time, but for half a millisecond by which a file's times may be
  /// rounded, nor in a hole: where neighbours are more than a second and more than five median periods apart.
  [[nodiscard]] std::optional<Place> find(Stamp time) const;

  [[nodiscard]] Stamp first() const { return times_.front(); }
  [[nodiscard]] Stamp last() const { return times_.back(); }

 private:
  std::vector<Stamp> times_;
  Stamp widest_{};
};

/// Where the robot was: a file in TUM format (t tx ty tz qx qy qz qw), of a motion capture system say.
class Trajectory {
 public:
  /// @throws files::FileError
  explicit Trajectory(const std::filesystem::path& file);

  /// Between the two poses around it: straight, the heading by the shorter way. t_s is 0. Nothing where there is none.
  [[nodiscard]] std::optional<runs::PoseRow> at(Stamp time) const;
  [[nodiscard]] const Timeline& timeline() const { return timeline_; }

 private:
  std::vector<runs::PoseRow> poses_;
  Timeline timeline_;
};

/// What both wheels have turned in all.
struct WheelTurns {
  double left_rad = 0, right_rad = 0;
};

/// The wheels that drive from one pose to the next on exact arcs (localisation::Odometry, inverted), from 0 on: with T
/// the turn between two headings, by the shorter way, and c, e what the step is along and across the direction halfway,
///
///     D = c / sinc(T/2),   left += (D - T b/2) / r,   right += (D + T b/2) / r.
///
/// Wheels do not go sideways: e is left out, and told.
struct WheelsOfPoses {
  std::vector<WheelTurns> turns;  ///< one a pose
  double path_m = 0;              ///< sum of |D|
  double sideways_m = 0;          ///< sum of |e|
};
WheelsOfPoses wheels_of(const std::vector<localisation::Pose>& poses, const localisation::WheelGeometry& wheels);

/// The wheels' angles from a CSV file with a header line, whose columns may stand in any order and among others: t_s,
/// left_rad, right_rad (what each wheel has turned in all), or t_s, x_m, y_m, heading_rad (of a robot that tells only
/// its own dead reckoning).
class WheelFile {
 public:
  /// @throws files::FileError naming the line
  WheelFile(const std::filesystem::path& file, const localisation::WheelGeometry& wheels);

  /// Between the two readings around it, as if the wheels had turned evenly. Nothing where there are none.
  [[nodiscard]] std::optional<WheelTurns> at(Stamp time) const;
  [[nodiscard]] const Timeline& timeline() const { return *timeline_; }
  /// What a person should know of it, a sentence each.
  [[nodiscard]] const std::vector<std::string>& events() const { return events_; }

 private:
  std::vector<WheelTurns> turns_;
  std::optional<Timeline> timeline_;
  std::vector<std::string> events_;
};

}  // namespace twocone::foreign
