// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "vision/calibration.h"

/// The results of a comparison of a simulated with a real run: numbers only, for table, files and page.
namespace twocone::compare {

// ---- stage by stage

enum class Light {
  kNone,        ///< no limit, or no number to compare with it
  kGreen,       ///< within the limit
  kAmber,       ///< within twice the limit
  kRed,         ///< beyond twice the limit
  kCannotTell,  ///< the number's sigma exceeds the limit, and the number is not certainly beyond it
};
/// Returns none, green, amber, red or cannot tell.
std::string_view to_string(Light light);

/// A step from image to pose.
enum class Stage { kImage, kDetection, kDisparity, kRange, kBearing, kFix, kOdometry, kTrajectory, kTiming };
/// Returns image, detection, disparity, range, bearing, fix, odometry, trajectory or timing.
std::string_view to_string(Stage stage);

/// One quantity of one stage, in both runs. Fields that do not apply or are unknown are empty.
struct Row {
  Stage stage = Stage::kImage;
  std::string name;  ///< as the table prints it: "lower rim, radius"
  std::string unit;  ///< of all numbers of the row: px, mm, deg, ms, %, Hz, grey, 1; mm/m
  std::optional<double> simulated, real;
  std::optional<double> gap;        ///< the difference that the limit applies to, >= 0
  std::optional<double> gap_sigma;  ///< standard deviation of simulated - real, if known
  std::string limit_key{};          ///< key of the limit (LimitKind::key); empty: no limit
  std::optional<double> limit{};
  Light light = Light::kNone;
  std::string note{};  ///< why a number is missing, or what the number measures
};

// ---- possible causes

/// A possible cause of a difference between the runs.
enum class Cause {
  kFocalLength,  ///< this cause and the next four are of one view
  kCentre,
  kTilt,
  kMirrorShape,
  kRollingShutter,
  kMirrorsAlignment,
  kMirrorsHeights,
  kSkew,     ///< between the views' exposures, in addition to the difference of their stamps
  kLatency,  ///< age of the images at their stamps
  kWheelRadius,
  kWheelRatio,
  kWheelSeparation,
  kSlip,
  kLandmark,           ///< a landmark is not at its place in the map
  kExposureAndColour,  ///< this cause and the next three are of one view
  kNoise,
  kSharpness,
  kFramesLost,
  kFrameRate,
  kStampedSkew,
};
/// Returns focal length, centre, tilt, ...
std::string_view to_string(Cause cause);
/// Returns how to make both runs agree, in one sentence.
std::string_view advice_for(Cause cause);

/// The quantity of which a gap is measured.
enum class Quantity { kRange, kOdometry, kBrightness, kNoise };
/// Returns range, odometry, brightness or noise.
std::string_view to_string(Quantity quantity);

enum class SourceVerdict {
  kDiffers,     ///< the p-value of the difference is below the level
  kAgrees,      ///< the data do not show a difference
  kCannotTell,  ///< the data do not determine the source
};
/// Returns differs, agrees or cannot tell.
std::string_view to_string(SourceVerdict verdict);

/// One number of a source.
struct Component {
  std::string name;  ///< as in a robot file, calibration.json or an effect: upper.centre_px.column
  std::string unit;
  double simulated = 0, real = 0;
  double sigma = 0;  ///< of real - simulated, > 0
  [[nodiscard]] double difference() const { return real - simulated; }
};

/// The part of one gap that a source explains, by projection (see find_gaps). It is negative if the source hides a part
/// of another source's effect.
struct Share {
  Quantity of = Quantity::kRange;  ///< Gap::of
  double share = 0;
};

/// One possible cause of the gap, with its test.
struct Source {
  Cause cause = Cause::kFocalLength;
  std::optional<vision::Side> view{};  ///< for a cause of one view
  std::string landmark{};              ///< name, for Cause::kLandmark
  SourceVerdict verdict = SourceVerdict::kCannotTell;
  std::vector<Component> components{};    ///< empty if the data determine none
  double chi_squared = 0;                 ///< of the differences against 0
  double p_value = 1;                     ///< probability of that or more, by chance; compared with Comparison::level
  std::string reason{};                   ///< why the data do not determine it
  std::vector<Share> shares{};            ///< only of a source that differs
  std::vector<std::string> confusable{};  ///< names of sources with nearly the same effect on the data
  [[nodiscard]] bool differs() const { return verdict == SourceVerdict::kDiffers; }
  /// Returns the view or the landmark; empty for the robot as a whole.
  [[nodiscard]] std::string where() const { return view ? std::string(to_string(*view)) : landmark; }
  /// Returns the source's name: "upper centre".
  [[nodiscard]] std::string name() const;
  /// Returns how to make both runs agree; empty for a source that does not differ.
  [[nodiscard]] std::string_view advice() const { return differs() ? advice_for(cause) : ""; }
};
/// Returns `before` and the unit; "" for numbers without a unit.
std::string unit_after(std::string_view before, const std::string& unit);

/// Returns the source with that cause; null if there is none. @param view for a cause of one view
const Source* find_source(const std::vector<Source>& sources, Cause cause,
                          std::optional<vision::Side> view = std::nullopt);
/// Returns the source with that cause if it differs; otherwise null.
const Source* find_differing(const std::vector<Source>& sources, Cause cause,
                             std::optional<vision::Side> view = std::nullopt);

/// The distance of the real run from the same run without any difference from the simulated one.
struct Gap {
  Quantity of = Quantity::kRange;
  std::string unit;
  double before = 0;              ///< as measured; for many numbers, their root mean square
  double after = 0;               ///< after correction of the differences that were found
  std::optional<double> floor{};  ///< the gap of the simulation, or of noise; empty: the simulation has no such gap
  /// Share that remains in `after`, floor included: the projection of the remainder on the gap. Mostly within 0 to 1.
  std::optional<double> unexplained{};
  /// Share that is corrected by numbers of the calibration that no source names as different. Either both runs have the
  /// same deviation, or one number alone is not determined. This share, `unexplained` and the sources' shares add to 1.
  std::optional<double> unnamed{};
};

// ---- data of the figures

/// A residual of one landmark at one frame.
struct ResidualPoint {
  double t_s = 0;
  std::size_t landmark = 0;         ///< index into Comparison::map
  double range_m = 0;               ///< from the reference pose to the landmark's axis; 0: unknown
  double before_m = 0;              ///< the run's own range minus the true one from the reference pose
  std::optional<double> after_m{};  ///< the same for the range under the calibrated rig; empty: no such range
};

/// One frame of each run, taken at about the same place.
struct Exhibit {
  std::array<std::filesystem::path, 2> simulated_images, real_images;  ///< lower, upper
  runlog::PoseRow simulated, real;
};

/// All results of a comparison.
struct Comparison {
  std::string simulated, real;  ///< folders of the runs, as the command named them
  bool is_rendered = false;     ///< whether the simulated images were rendered at the real run's poses
  std::string reference;        ///< source of the real robot's poses: truth, given trajectory, estimate
  std::vector<std::string> notes;
  std::size_t simulated_frames = 0, real_frames = 0;
  std::size_t matched_by_time = 0, matched_by_pose = 0;
  std::vector<Row> rows;
  std::vector<Source> sources;
  std::vector<Gap> gaps;
  double false_alarm = 1e-3;  ///< probability of a false alarm in the whole comparison
  double level = 0;           ///< the same for one source: false_alarm over the number of sources tested
  config::Map map;
  config::Robot simulated_robot, real_robot;
  /// At most kMostPoses poses each.
  std::vector<runlog::PoseRow> simulated_path, real_path, real_odometry;
  std::vector<ResidualPoint> simulated_residuals, real_residuals;
  std::vector<Exhibit> exhibits;  ///< a few, spread over the run
  [[nodiscard]] bool is_within_limits() const;
  [[nodiscard]] std::vector<const Source*> sources_with(SourceVerdict verdict) const;
};

}  // namespace twocone::compare
