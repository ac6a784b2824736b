// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "vision/mirror_view.h"
#include "vision/rig_circles.h"
#include "vision/sighting.h"

namespace twocone::vision {

enum class Side { kLower, kUpper };
std::string_view to_string(Side side);

/// An upright cylinder at a known place of the world.
struct KnownLandmark {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< of its axis
  double radius_m = 0;                                ///< > 0
  double top_m = 0;                                   ///< of its flat top above the floor
};

/// What one view of one frame shows of a landmark.
struct LandmarkSighting {
  std::size_t landmark = 0;  ///< index into CalibrationProblem::landmarks
  Side side = Side::kLower;
  Sighting sighting;
  /// The view's stamped time of exposure less the frame's time. Asks for the frame's twist; without one it counts as 0.
  double late_s = 0;
};

/// How the body moves: forward along its x axis, and its turn.
struct BodyTwist {
  double forward_mps = 0;
  double turn_radps = 0;
};

/// Total angles of the wheels at a time.
struct WheelReading {
  double t_s = 0;
  double left_rad = 0;
  double right_rad = 0;
};

struct CalibrationFrame {
  std::vector<LandmarkSighting> sightings;
  /// From the frame before it in the list (first reading) to this one (last); fewer than two: the way between them is
  /// not known (the first frame, another run, the robot was carried).
  std::vector<WheelReading> wheels;
  /// At the frame's time, as the wheels tell it. None: not known, this frame says nothing of timing and its pictures
  /// count as taken at the frame's time: with true skew such frames pull the rig's numbers, so let them be few.
  std::optional<BodyTwist> twist;
};

/// The wheels as they are believed, and how far.
struct WheelBelief {
  double radius_m = 0;              ///< > 0
  double separation_m = 0;          ///< > 0
  double slip = 0.01;               ///< relative standard deviation of each wheel's way, > 0
  double slip_correlation_s = 2.0;  ///< its time constant as a Gauss-Markov process, > 0
  double angle_step_rad = 0.006;    ///< of one reading: an encoder's count, >= 0
};

/// Standard deviations of what is believed beforehand: what a builder measures with a ruler, and for the rest what a
/// careful hand leaves. All > 0. They keep what the data do not tell where it was, and say with which sigma.
struct CalibrationPriors {
  double length_m = 0.002;  ///< mirror radius, lens to tip, mirror separation, lens height
  double centre_px = 20;
  double rim_share = 0.2;        ///< of the rim's radius in the picture
  double azimuth_rad = 0.1;      ///< of the lower view, and of the upper against the lower
  double tilt_rad = 0.035;       ///< 2 degrees
  double axis_offset_m = 0.005;  ///< of the upper view against the lower
  /// Of the lower view against the body's origin, which stands below that mirror's axis by definition. Only curves tell
  /// it, and only against the middle of the wheels: give it room where that is what poses are to be of.
  double lower_axis_offset_m = 0.0001;
  double apex_rad = 0.0175;          ///< 1 degree
  double distortion = 0.1;           ///< k1 and k2
  double wheel_radius_share = 0.03;  ///< of both together
  double wheel_ratio = 0.01;         ///< right over left
  double wheel_separation_m = 0.005;
  double latency_s = 0.1;  ///< as the next two, about 0 and with CalibrationProblem::fit_timing only
  double skew_s = 0.03;
  double readout_s = 0.04;
};

struct CalibrationProblem {
  Rig rig;  ///< as believed so far
  std::optional<WheelBelief> wheels;
  std::vector<KnownLandmark> landmarks;
  std::vector<CalibrationFrame> frames;
  std::optional<RimMeasurement> lower_rim, upper_rim;
  CalibrationPriors priors{};
  /// Also k1 and k2 of both lenses, about the believed centre in units of the believed focal length where the rig has
  /// no distortion yet.
  bool fit_distortion = false;
  /// At least so much, px, do sightings of one landmark, of one ring of the picture, and of both have in common in one
  /// view, radially and across: light from one side, a renderer's edges. Many frames do not average it away. More is
  /// taken where the residuals show it. >= 0. The default is that of 0.08 px
  /// in one row (an edge rendered with anti-aliasing) over ten rows. It does not cover all: of a perfect rig, seen in a
  /// run rendered so, an apex came out 0.01 degrees and the views' turn against each other 0.02 degrees off, 4 sigmas.
  double systematic_px = 0.025;
  /// Also when pictures were taken, where frames have a twist: `upper.skew_s`, by which the upper view's exposure is
  /// later than its stamp says, against the lower's; `lower.readout_s` and `upper.readout_s`, from the first row's
  /// exposure to the last one's, stamps being of the middle row; and with wheels `latency_s`, by which both views'
  /// pictures are older than their stamps say.
  bool fit_timing = false;
  std::array<int, 2> height_px{};  ///< of the pictures, lower and upper; below 2: no readout of that view. >= 0
  /// > 0: the map is believed to so much only, in x and y of each landmark. 0: it is trusted.
  double landmark_sigma_m = 0;
};

/// A number of the rig, before and after. In the units that its name ends with.
struct CalibratedParameter {
  std::string name;  ///< of its key in a robot file where it has one: lower.centre_px.column, mirror_separation_m
  double before = 0;
  double after = 0;
  double sigma = 0;        ///< of `after`: of data and priors together
  double prior_sigma = 0;  ///< of `before`
  /// The data tell it at least as well as the prior did. Else it keeps its prior: after == before.
  bool observed = false;
  bool derived = false;  ///< computed from others of the list: focal lengths, the upper view's own azimuth and offset
};

/// What a sighting says against the model, measured minus predicted.
struct SightingResidual {
  std::size_t frame = 0;                                ///< index into CalibrationProblem::frames
  std::size_t sighting = 0;                             ///< index into that frame's sightings
  Eigen::Vector2d before_px = Eigen::Vector2d::Zero();  ///< with the believed rig, its pose fitted
  Eigen::Vector2d after_px = Eigen::Vector2d::Zero();
  bool outlier = false;  ///< left out of the answer
};

/// By how much a landmark stands elsewhere than its map says.
struct LandmarkShift {
  std::size_t landmark = 0;  ///< index into CalibrationProblem::landmarks
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();
  /// Of the shift alone, whatever the other numbers are. The common shift and turn of all, which only the map's own
  /// sigma holds, are in it: to test one landmark take shifts_among().
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

enum class CalibrationVerdict {
  kOk,
  kNoSolver,         ///< this build has no Ceres
  kTooFewFrames,     ///< fewer than kMinFrames frames with two landmarks each
  kTooFewLandmarks,  ///< fewer than two landmarks were seen at all
  kContradictory,    ///< no agreement: more than a third of the sightings would be outliers, or no solution
};
std::string_view to_string(CalibrationVerdict verdict);

struct CalibrationResult {
  static constexpr std::size_t kMinFrames = 4;

  CalibrationVerdict verdict = CalibrationVerdict::kTooFewFrames;
  std::optional<Rig> rig;             ///< with kOk
  std::optional<WheelBelief> wheels;  ///< with kOk and where there were wheels; both radii as their mean
  std::vector<CalibratedParameter> parameters;
  /// Of `after` of all parameters, in their order, derived ones included. What is not observed has its prior's
  /// variance.
  Eigen::MatrixXd covariance;
  /// Of those that were seen, in the map's order; none where the map is trusted.
  std::vector<LandmarkShift> landmark_shifts;
  Eigen::MatrixXd landmark_covariance;  ///< joint, m^2: x and y of each of landmark_shifts
  /// x m, y m, heading rad in the world of each frame of the problem: where its lower picture with late_s = 0 was taken
  /// (latency earlier than the frame's time). None: dropped.
  std::vector<std::optional<Eigen::Vector3d>> poses;
  std::vector<SightingResidual> residuals;
  std::size_t frames_used = 0;
  std::size_t frames_dropped = 0;  ///< fewer than two landmarks, or no pose explains what they show
  std::size_t outliers = 0;
  /// Square root of the sightings' reduced chi-squared: how many times their stated sigma they scatter. All sigmas are
  /// scaled by it.
  double sighting_scale = 0;
  /// Standard deviation of what sightings of one landmark in one view have in common, as
  /// CalibrationProblem::systematic_px.
  double systematic_px = 0;
  /// As sighting_scale, of the wheels; sigmas are scaled by it where it is above 1 only. 0: no wheels.
  double wheel_scale = 0;
  /// Of pixel coordinates, outliers left out. Lower, upper.
  std::array<double, 2> rms_before_px{};
  std::array<double, 2> rms_after_px{};
  std::array<std::size_t, 2> sightings{};
};

/// False in a build without Ceres.
bool can_calibrate();

/// Bundle adjustment: the rig's own numbers and the wheels' from a drive among known landmarks.
///
/// Unknowns: for each frame the pose (x, y, heading) and the relative slip of both wheels since the last one (a
/// Gauss-Markov process); for each view centre, rim radius in pixels, tilt, apex angle, mirror radius R and distance d;
/// lens height; mirror separation; the lower view's azimuth and offset, and the upper's against them; the wheels' mean
/// radius, the right one over the left one, and their separation.
/// For each landmark, each of sixteen rings of the picture, and each landmark in a ring also a bias of its sightings.
/// When asked for: the landmarks' places and the times of exposure. Data: whitened pixels of near points; the way that
/// the wheels tell; rim circles; the priors.
///
/// What can be told from what:
/// * r_m, R and d come in as v = (d / R + cot a) r_m. Landmarks tell v; the rim circle alone tells r_m, and then R.
/// * Tops of one height tell v (top - lens - d) as one number: v and the lens height part by the prior of the latter,
/// or by
///   tops of different heights. d (~ 1 / (rho + d)^2) and the apex (constant in h) part from it by a spread of ranges.
/// * Centre and tilt move a picture alike, c and v t, but turn bearings by c / h and t h / v: landmarks all round part
/// them.
/// * Both azimuths together, and both offsets together, are a choice of the body frame: the wheels alone tell them, an
///   azimuth by driving straight, offsets by driving curves. So the upper view's are kept against the lower's.
/// * Skew and readout move a landmark's picture by the body's way in that time: changing speed and turn part them from
///   the upper view's azimuth and offset and from tilts. Latency moves both ends of the wheels' way alike: a drive of
///   one speed along one arc does not tell it.
/// * Landmarks that are not trusted leave their common shift and turn to their priors, and their common scale to the
///   wheels' radius and the heights.
///
/// A sighting taken tau after its frame's time sees the pose moved along the frame's twist by tau, on the chord of the
/// arc: (omega tau)^2 / 24 of the way is neglected, and a tau^2 / 2 of a change of speed a: 0.2 mm at 0.5 m/s^2 and
/// 25 ms. In the wheels' rows the poses at both ends are moved so by the latency; with fit_timing a way one of whose
/// ends has no twist is left out.
///
/// A parameter that the data tell less well than its prior did is held at it, the worst first; it then counts as an
/// uncertain constant in the others' sigmas ("consider" covariance: Schmidt 1966; Bierman 1977, ch. 8).
/// Outliers: Cauchy's loss with a shrinking scale; what then lies beyond kOutlierSigmas is left out and the rest solved
/// by plain least squares.
/// @throws std::invalid_argument naming what lies outside its domain: a landmark's index, a covariance that is not
/// positive
///   definite, priors and wheels that are not > 0, wheel readings that are not finite or run backwards, twists and
///   times that are not finite, a landmark_sigma_m or height_px that is not >= 0
CalibrationResult calibrate(const CalibrationProblem& problem);

/// A landmark's shift less what the others' best common shift, turn and scale (least squares, unweighted, of the first
/// order) would move it by: what remains when the map as a whole lies elsewhere, or is measured with another rule,
/// which only the wheels' radius and the heights contradict.
struct RelativeShift {
  LandmarkShift shift;     ///< of what remains, and its covariance
  double chi_squared = 0;  ///< of two degrees of freedom where the landmark stands as the others do
  bool moved = false;      ///< above the limit
};

/// Each landmark of the result against the others that stand, in the result's order. A moved one pulls the others'
/// common shift and makes them seem moved: so while four or more stand, the one of the greatest chi-squared no longer
/// counts as standing where that exceeds the limit. Of three, which one moved is not told: all may be above it. Of
/// fewer none can be tested, and the answer is empty.
/// @param landmarks the problem's
/// @param chi_squared_limit exp(-limit / 2) is the false-alarm level of one landmark
std::vector<RelativeShift> shifts_among(const CalibrationResult& result, const std::vector<KnownLandmark>& landmarks,
                                        double chi_squared_limit);

/// Of sightings that belong to a Gaussian of the sightings' own scale one in 25,000 lies beyond.
constexpr double kOutlierSigmas = 4.5;

}  // namespace twocone::vision
