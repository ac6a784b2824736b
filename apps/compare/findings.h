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

/// What a comparison finds: the sources, the gaps that they explain, and the table of the stages.
namespace twocone::compare {

/// Differences of a source's numbers that occur although nothing was changed, in addition to the sigma that the data
/// state: effects of another path, of other pixels and of a renderer's edges. Standard deviations, for the difference
/// of two runs.
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

/// Tests every possible cause of a gap that both runs' data can decide. Each test is chi-squared of real minus
/// simulated under both covariances, at the level `false_alarm` over the number of sources that can be decided
/// (Bonferroni). So at most the share `false_alarm` of comparisons without a difference name any source. The data of
/// one drive correlate some numbers of a robot: Source::confusable names those with a correlation beyond kConfusable.
/// @param level set to the level of each source
std::vector<Source> find_sources(const BothRuns& runs, const Images& images, double false_alarm, double& level);
constexpr double kConfusable = 0.9;

/// A range of a frame that the calibration did not use.
struct HeldOutRange {
  double before_m = 0;          ///< under the believed rig, minus the distance to the reference
  double after_m = 0;           ///< with the rig and the exposure times that were found; minus the same distance
  double sigma_m = 0;           ///< stated by the new range
  std::vector<double> parts_m;  ///< contribution of each source, in the order of the sources; see below
};

/// Returns ranges from up to `most` frames between those of the calibration, made from new sightings with Side::found.
/// `before_m` is also given for ranges that the run withheld because both views contradict each other under the
/// believed rig. The part of a source is the change of the new range when that source alone is set back to what the
/// robot believes: its numbers of the rig, a landmark's place, or the time of the upper view or of a row. It is 0 for a
/// source that does not differ or does not act on ranges. Where no independent reference exists, the reference is the
/// frame's own fix by the new sightings, at its time. Returns nothing where there is no calibration or no reference.
/// Errors: kBadData (images of another size).
Result<std::vector<HeldOutRange>> held_out_ranges(const Side& real, const std::vector<Source>& sources, int most,
                                                  const std::function<void(double)>& progress);

/// Returns the gaps of the real run before and after correction, and fills Source::shares: the part of each gap that
/// each source explains.
///
/// A share is a projection: with e the gap of each measurement and e_k the part that source k adds to it, sum(e_k e) /
/// sum(e^2). `unexplained` is the same projection of the remainder, after all of the calibration's numbers are
/// corrected. Gap::unnamed is the part that these numbers correct without a source that differs. All of these add to 1.
/// A share is below 0 where a source hides a part of another's effect. Noise is a part of e, so it stays unexplained.
/// range held-out ranges; e is the range under the believed rig minus the distance to the reference
/// odometry the wheels' motion over each metre, in the frame of its start, against the reference; e_k comes from the
/// sizes of the wheels and the age of the images; there is no floor where the simulated poses were rendered again,
/// because nothing was driven there
/// brightness log ratios of the images' colours; e_k is the gain that was found
/// noise squares of grey levels; `after` is the uncertainty of the gap that was found
std::vector<Gap> find_gaps(const BothRuns& runs, const std::vector<HeldOutRange>& held_out, const Images& images,
                           std::vector<Source>& sources);

/// Believed or measured numbers of the wheels: their sizes, and how much later they are read than images are taken.
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

/// Wheel errors are measured over this length of the path.
constexpr double kOdometryStretch_m = 1.0;

/// A quantity that can have a limit.
struct LimitKind {
  const char* key;    ///< as in the option --max-KEY and in compare.json: rim-px
  double by_default;  ///< in the unit that the key names
  const char* what;   ///< for --help
};
/// Returns all kinds in the order of the table.
const std::vector<LimitKind>& limit_kinds();
/// Limits by LimitKind::key. A key that is missing has its default.
using Limits = std::map<std::string, double>;

/// Returns green within the limit, amber within twice the limit, red beyond. A gap whose sigma exceeds the limit gives
/// kCannotTell, unless it is beyond the limit by kCertain of its sigmas. @param sigma of the gap; none: the gap is
/// exact
Light light_of(double gap, std::optional<double> sigma, double limit);
/// Noise puts a gap that just meets its limit this far beyond it once in 370 times.
inline constexpr double kCertain = 3;

/// Returns the table: each stage from image to pose, simulated and real, with lights. Numbers of sources (rims, gains,
/// noise, sharpness) come from the sources.
std::vector<Row> find_rows(const BothRuns& runs, const Residuals& of_simulated, const Residuals& of_real,
                           const std::vector<Source>& sources, const Limits& limits);

}  // namespace twocone::compare
