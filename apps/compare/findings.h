// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/both_runs.h"
#include "apps/compare/comparison.h"
#include "hal/result.h"
#include "localisation/trajectory_error.h"

/// The findings of a comparison: the sources, the gaps that they explain, and the table of the stages.
namespace twocone::compare {

/// Standard deviations of the difference of a source's numbers between two runs of an unchanged robot, in addition to
/// the sigmas that the data state. Other paths, other pixels and a renderer's edges cause such differences.
struct ModelSigmas {
  double centre_px = 0.03;
  double rim_px = 0.05;
  double tilt_rad = 1e-4;
  double azimuth_rad = 3e-4;
  double apex_rad = 2e-4;
  double offset_m = 2e-4;
  double length_m = 1e-4;
  double log_gain = 0.005;
  double vignetting = 0.02;
  double blur_px = 0.05;
  double rate_share = 0.002;
  double landmark_m = 0.002;
};

/// Returns every possible cause of a gap, tested if both runs' data determine it. Most tests are chi-squared tests of
/// real minus simulated under the sum of both covariances; lost frames use lost_p_value. The level of each test is
/// `false_alarm` over the number of tested sources (Bonferroni). So at most the share `false_alarm` of comparisons
/// without a difference name any source. In the data of one drive some numbers of a robot are correlated:
/// Source::confusable names the sources whose correlation exceeds kConfusable.
/// @param level receives the level of a test
std::vector<Source> find_sources(const BothRuns& runs, const Images& images, double false_alarm, double& level);
constexpr double kConfusable = 0.9;

/// A range of a frame that the calibration did not use.
struct HeldOutRange {
  double before_m = 0;          ///< under the believed rig, minus the distance to the reference by the map
  double after_m = 0;           ///< the same with the rig, the exposure times and the landmark's place that were found
  double sigma_m = 0;           ///< standard deviation that the new range states
  std::vector<double> parts_m;  ///< contribution of each source, in the order of the sources; see held_out_ranges()
};

/// Returns ranges from up to `most` frames between those of the calibration, made from new sightings with Side::found.
/// A range that the run withheld, because both views contradict each other under the believed rig, has a `before_m`
/// too. The part of a source is the change of the new range if that source alone is set back to what the robot
/// believes: its numbers of the rig, a landmark's place, or the time of the upper view or of a row. It is 0 for a
/// source that does not differ or does not act on ranges. Without an independent reference, the reference is the
/// frame's own fix from the new sightings, at the frame's time. The list is empty without calibration or reference.
/// Errors: kBadData (an image of another size, or damaged).
Result<std::vector<HeldOutRange>> held_out_ranges(const Side& real, const std::vector<Source>& sources, int most,
                                                  const std::function<void(double)>& progress);

/// Returns the gaps of the real run before and after correction, and fills Source::shares: the part of each gap that
/// each source explains.
///
/// A share is a projection, sum(e_k e) / sum(e^2). Here e is the gap of each measurement, and e_k is the part that
/// source k adds to it. `unexplained` is the same projection of the remainder, after all of the calibration's numbers
/// are corrected. Gap::unnamed is the part that these numbers correct without a source that differs. All these parts
/// add to 1. A share is below 0 if a source hides a part of another's effect. Noise is a part of e and not explained.
/// - range: held-out ranges; e is the range under the believed rig minus the distance to the reference.
/// - odometry: e is the wheels' motion over each metre, in the frame of its start, minus that of the reference. e_k
///   comes from the sizes of the wheels and the age of the images. A simulated run from render_again() gives no floor,
///   because nothing was driven in it.
/// - brightness: e is the log ratio of the images' colours, and e_k is the gain that was found.
/// - noise: e is the difference of the noise, in grey levels. In a view whose noise differs, `after` is the sigma of e.
std::vector<Gap> find_gaps(const BothRuns& runs, const std::vector<HeldOutRange>& held_out, const Images& images,
                           std::vector<Source>& sources);

/// Believed or measured numbers of the wheels: their sizes, and the time from an image's exposure to the reading.
struct WheelsAs {
  double radius_m = 0, separation_m = 0;
  double latency_s = 0;
};

/// Returns the odometry from a run's wheel angles with such wheels, at the times of its images, beginning at the run's
/// first odometry pose. It interpolates linearly between two readings.
std::vector<runlog::PoseRow> odometry_by(const runlog::RunData& run, const WheelsAs& wheels);

/// Returns pairs of reference and odometry at the frames that have a reference.
std::vector<localisation::PosePair> pairs_with(const std::vector<std::optional<runlog::PoseRow>>& reference,
                                               const std::vector<runlog::PoseRow>& odometry);

/// Length of the path over which each error of the wheels is measured.
constexpr double kOdometryStretch_m = 1.0;

/// A quantity that can have a limit.
struct LimitKind {
  const char* key;    ///< as in the option --max-KEY and in compare.json, e.g. rim-px
  double by_default;  ///< in the unit that the key names
  const char* what;   ///< description for --help
};
/// Returns all kinds in the order of the table.
const std::vector<LimitKind>& limit_kinds();
/// Limits by LimitKind::key. A missing key has its default.
using Limits = std::map<std::string, double>;

/// Returns green within the limit, amber within twice the limit, and red beyond. If the sigma exceeds the limit, it
/// returns kCannotTell, unless the gap exceeds the limit by more than kCertain sigmas.
/// @param sigma standard deviation of the gap; empty: the gap is exact
Light light_of(double gap, std::optional<double> sigma, double limit);
/// A normal variable deviates by more than this number of sigmas once in 370 times.
inline constexpr double kCertain = 3;

/// Returns the table: each stage from image to pose, simulated and real, with lights. Numbers of sources (rims, gains,
/// noise, sharpness) come from the sources.
std::vector<Row> find_rows(const BothRuns& runs, const Residuals& of_simulated, const Residuals& of_real,
                           const std::vector<Source>& sources, const Limits& limits);

}  // namespace twocone::compare
