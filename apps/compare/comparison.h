// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/runs/run_data.h"

/// What a comparison of a simulated with a real run found: numbers alone, for table, files and page.
namespace twocone::compare {

// ---- stage by stage

enum class Light {
  kNone,        ///< no limit, or no number to hold against it
  kGreen,       ///< within the limit
  kAmber,       ///< within twice the limit
  kRed,         ///< beyond
  kCannotTell,  ///< the number's sigma exceeds the limit, and the number is not beyond it for certain
};
/// none, green, amber, red, cannot tell.
std::string_view to_string(Light light);

/// One quantity of one stage, on both sides. Fields that do not apply, or are not known, are empty.
struct Row {
  std::string stage;  ///< image, detection, disparity, range, bearing, fix, odometry, trajectory, timing
  std::string name;   ///< as the table prints it: "lower rim, radius"
  std::string unit;   ///< of all numbers of the row: px, mm, deg, ms, %, Hz, grey, 1; mm/m
  std::optional<double> simulated, real;
  std::optional<double> gap;        ///< what the limit is for: how far apart both are, >= 0
  std::optional<double> gap_sigma;  ///< standard deviation of simulated - real, where it is known
  std::string limit_key{};          ///< its key among the limits; empty: it has none
  std::optional<double> limit{};
  Light light = Light::kNone;
  std::string note{};  ///< why a number is missing, or what it is of
};

// ---- why

enum class SourceVerdict {
  kDiffers,     ///< the data show it beyond the false-alarm level
  kAgrees,      ///< they do not
  kCannotTell,  ///< they do not carry it
};
/// differs, agrees, cannot tell.
std::string_view to_string(SourceVerdict verdict);

/// One number of a source.
struct Component {
  std::string name;  ///< as a robot file, calibration.json or an effect calls it: upper.centre_px.column
  std::string unit;
  double simulated = 0, real = 0;
  double sigma = 0;  ///< of real - simulated, > 0
  [[nodiscard]] double difference() const { return real - simulated; }
};

/// Part of one gap that a source explains, by Shapley-like projection (see shares.h): may be negative where it hides
/// a part of another's.
struct Share {
  std::string of;  ///< Gap::of
  double share = 0;
};

/// One possible cause of the gap, tested.
struct Source {
  std::string kind;   ///< focal length, centre, tilt, rig geometry, gain, noise, sharpness, rolling shutter, skew, ...
  std::string where;  ///< lower, upper, a landmark's name; empty: the robot as a whole
  SourceVerdict verdict = SourceVerdict::kCannotTell;
  std::vector<Component> components;      ///< empty where there is nothing to be told
  double chi_squared = 0;                 ///< of the differences against 0
  double p_value = 1;                     ///< of that or more, by chance; held against Comparison::level
  std::string reason{};                   ///< why it cannot be told
  std::vector<Share> shares{};            ///< of a source that differs
  std::vector<std::string> confusable{};  ///< sources that nearly the same data would show, by name
  std::string advice{};                   ///< what to change so that both agree; of a source that differs
  /// "upper centre": what it is called.
  [[nodiscard]] std::string name() const { return where.empty() ? kind : where + " " + kind; }
};

/// How far the real run is from what it would be without any difference.
struct Gap {
  std::string of;  ///< range, odometry, brightness, noise, sharpness, lost frames
  std::string unit;
  double before = 0;              ///< as it is, root mean square where it is of many
  double after = 0;               ///< with what was found put right
  std::optional<double> floor{};  ///< of the simulation, or what noise leaves; none: the simulation has no such gap
  /// Share that is left `after`, floor included: the projection of what is left on the gap. 0 to 1 and rarely beyond.
  std::optional<double> unexplained{};
  /// Share that is put right, but by numbers that no source names as different, since both runs have them, or one
  /// alone cannot be told. With `unexplained` and the sources' shares it adds to 1.
  std::optional<double> unnamed{};
};

// ---- what is drawn

/// A residual of one landmark at one frame.
struct ResidualPoint {
  double t_s = 0;
  std::size_t landmark = 0;         ///< index into Comparison::map
  double range_m = 0;               ///< from the reference pose to the landmark's axis; 0: not known
  double before_m = 0;              ///< range, as the run had it, less the distance to the reference pose
  std::optional<double> after_m{};  ///< with what was found; none on the simulated side
};

/// A frame of each run, taken at about one place.
struct Exhibit {
  std::filesystem::path simulated_lower, simulated_upper, real_lower, real_upper;  ///< pictures
  runs::PoseRow simulated, real;
  double apart_m = 0;     ///< between both places
  double turned_rad = 0;  ///< between both headings, absolute
};

/// All that was found.
struct Comparison {
  std::string simulated, real;  ///< the runs' folders as they were named
  bool is_rendered = false;     ///< the simulated pictures were rendered at the real run's poses
  std::string reference;        ///< where the real robot is taken to have been: truth, given trajectory, estimate
  std::vector<std::string> notes;
  std::size_t simulated_frames = 0, real_frames = 0;
  std::size_t matched_by_time = 0, matched_by_pose = 0;
  std::vector<Row> rows;
  std::vector<Source> sources;
  std::vector<Gap> gaps;
  double false_alarm = 1e-3;  ///< of a whole comparison
  double level = 0;           ///< of one source: false_alarm over the number of sources tested
  files::Map map;
  files::Robot simulated_robot, real_robot;
  /// At most some thousand poses each.
  std::vector<runs::PoseRow> simulated_path, real_path, real_odometry;
  std::vector<ResidualPoint> simulated_residuals, real_residuals;
  std::vector<Exhibit> exhibits;  ///< a few, spread over the run
  [[nodiscard]] bool is_within_limits() const;
};

}  // namespace twocone::compare
