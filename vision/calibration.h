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
#include "vision/ranging.h"
#include "vision/rim.h"
#include "vision/uncertain_rig.h"

namespace twocone::vision {

/// The sighting of a landmark in one view of one frame.
struct LandmarkSighting {
  std::size_t landmark = 0;  ///< index into CalibrationProblem::landmarks
  Side side = Side::kLower;
  Sighting sighting;
  /// The view's time stamp of its exposure minus the frame's time. It is used with the frame's twist only; without a
  /// twist it counts as 0.
  double late_s = 0;
};

/// The wheels' total angles at one time.
struct WheelReading {
  double t_s = 0;
  double left_rad = 0;
  double right_rad = 0;
};

struct CalibrationFrame {
  std::vector<LandmarkSighting> sightings;
  /// Readings from the previous frame of the list (first reading) to this frame (last reading). Fewer than two readings
  /// mean that the motion between the frames is not known: for the first frame, another run, or a robot that was
  /// carried.
  std::vector<WheelReading> wheels;
  /// Twist at the frame's time, from the wheels. Empty: unknown; the frame then gives no information on timing, and its
  /// images count as taken at the frame's time. If the true skew is not 0, such frames bias the rig's parameters, so
  /// keep them few.
  std::optional<BodyTwist> twist;
  /// Pose (x m, y m, heading rad) in the world from which the solution starts. Empty: from the sightings.
  std::optional<Eigen::Vector3d> start{};
};

/// The distance between the axes of two landmarks, as a tape measures it.
struct MeasuredDistance {
  std::size_t from = 0, to = 0;  ///< indices into CalibrationProblem::landmarks, different
  double distance_m = 0;         ///< > 0
  double sigma_m = 0;            ///< > 0
};

/// The believed parameters of the wheels, and how far they are trusted.
struct WheelBelief {
  double radius_m = 0;              ///< > 0
  double separation_m = 0;          ///< > 0
  double slip = 0.01;               ///< relative standard deviation of each wheel's travel, > 0
  double slip_correlation_s = 2.0;  ///< time constant of the slip as a Gauss-Markov process, > 0
  double angle_step_rad = 0.006;    ///< resolution of one reading: an encoder's count, >= 0
};

/// Standard deviations of the prior, all > 0. Those of lengths are what a builder measures with a ruler, the others are
/// the errors of careful assembly. A parameter that the data do not determine keeps its prior value, with this sigma.
struct CalibrationPriors {
  double length_m = 0.002;  ///< mirror radius, lens to tip
  double mirror_separation_m = 0.002;
  double lens_height_m = 0.002;
  double centre_px = 20;
  double rim_share = 0.2;        ///< share of the rim's radius in the image
  double azimuth_rad = 0.1;      ///< of the lower view, and of the upper relative to the lower
  double tilt_rad = 0.035;       ///< 2 degrees
  double axis_offset_m = 0.005;  ///< of the upper view relative to the lower
  /// Offset of the lower view from the body's origin, which lies below that mirror's axis by definition. Only curves
  /// determine it, and only relative to the middle of the wheels. Enlarge it where poses must refer to that point.
  double lower_axis_offset_m = 0.0001;
  double apex_rad = 0.0175;          ///< 1 degree
  double distortion = 0.1;           ///< k1 and k2
  double wheel_radius_share = 0.03;  ///< of both together
  double wheel_ratio = 0.01;         ///< right over left
  double wheel_separation_m = 0.005;
  double latency_s = 0.1;  ///< as the next two: used with CalibrationProblem::fit_timing only
  double skew_s = 0.03;
  double readout_s = 0.04;
};

struct CalibrationProblem {
  Rig rig;  ///< as believed before the calibration; its exposures are those of the frames' sightings
  std::optional<WheelBelief> wheels;
  /// Landmark::sigma is the prior of their places, tops and radii, which are estimated, too; 0: that number is trusted.
  std::vector<Landmark> landmarks;
  std::vector<CalibrationFrame> frames;
  std::optional<RimMeasurement> lower_rim, upper_rim;
  CalibrationPriors priors{};
  /// Also estimates k1 and k2 of both lenses. For a rig without distortion, they are about its
  /// MirrorViewSettings::lens_axis_px, in units of the believed focal length.
  bool fit_distortion = false;
  /// Standard deviation of k1 and k2 where they are not estimated: their errors count in the sigmas of what is
  /// estimated, above all of the rims. 0: they are exact. >= 0.
  double distortion_sigma = 0;
  /// Least standard deviation, px, of the error that sightings share in one view: those of one landmark, of one ring of
  /// the image, and of one landmark in one ring, radially and tangentially. It comes from light from one side and from
  /// a renderer's edges. Many frames do not average it out. A larger value is used where the residuals show one. >= 0.
  /// The default is 0.08 px in one row (an edge rendered with anti-aliasing), averaged over ten rows. It does not cover
  /// every such error: for a perfect rig in a run rendered that way, an apex was estimated 0.01 degrees wrong and the
  /// azimuth between the views 0.02 degrees wrong, 4 sigmas.
  double systematic_px = 0.025;
  /// Also estimates the times of exposure, from frames that have a twist. `upper.skew_s` is how much later than its
  /// stamp the upper view is exposed, relative to the lower view. `lower.readout_s` and `upper.readout_s` are the times
  /// from the first row's exposure to the last row's; stamps are those of the middle row. With wheels, `latency_s` is
  /// how much older both views' images are than their stamps.
  bool fit_timing = false;
  std::array<int, 2> height_px{};  ///< of the images, lower and upper; below 2: no readout of that view. >= 0
  /// The covariance of the start pose (x m, y m, heading rad) of the first frame that is used, which then counts as
  /// measured: it defines the world where the landmarks' places are not known. Empty: it is only a start.
  std::optional<Eigen::Matrix3d> first_pose_covariance{};
  std::vector<MeasuredDistance> distances{};
  /// The rig and its exposures are held as they are believed, with these errors (of rig and times), which count in all
  /// covariances. Priors of the rig are not used then. Empty: they are estimated.
  std::optional<BeliefErrors> held_rig{};
  /// The radii are known as shares of the map's size, with Landmark::sigma, as where the widths of images gave them:
  /// the prior of a radius is in proportion to the distance between its landmark and the one farthest from it. So radii
  /// do not determine the scale. False: they are known as lengths.
  bool radii_follow_scale = false;
};

/// A parameter of the rig before and after the calibration, in the unit that its name states.
struct CalibratedParameter {
  std::string name;  ///< its key in a robot file where it has one: lower.centre_px.column, mirror_separation_m
  double before = 0;
  double after = 0;
  double sigma = 0;        ///< of `after`, from data and priors together
  double prior_sigma = 0;  ///< of `before`
  /// Whether the data determine it at least as well as the prior did. If not, it keeps its prior: after == before.
  bool observed = false;
  bool derived = false;  ///< computed from others of the list: focal lengths, the upper view's own azimuth and offset
};

/// The residual of a sighting, measured minus predicted.
struct SightingResidual {
  std::size_t frame = 0;                                ///< index into CalibrationProblem::frames
  std::size_t sighting = 0;                             ///< index into that frame's sightings
  Eigen::Vector2d before_px = Eigen::Vector2d::Zero();  ///< with the believed rig and a fitted pose
  Eigen::Vector2d after_px = Eigen::Vector2d::Zero();
  bool outlier = false;  ///< excluded from the answer
};

/// The displacement of a landmark from its place in the map.
struct LandmarkShift {
  std::size_t landmark = 0;  ///< index into CalibrationProblem::landmarks
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();
  /// Marginal covariance of the shift. It includes the common translation and rotation of all landmarks, which only the
  /// map's own sigma limits: use shifts_among() to test one landmark.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

enum class CalibrationVerdict {
  kOk,
  kNoSolver,         ///< this build has no Ceres
  kTooFewFrames,     ///< fewer than kMinFrames frames show two landmarks each
  kTooFewLandmarks,  ///< fewer than two landmarks were seen at all
  kContradictory,    ///< no agreement: more than a third of the sightings would be outliers, or there is no solution
};
std::string_view to_string(CalibrationVerdict verdict);

struct CalibrationResult {
  static constexpr std::size_t kMinFrames = 4;

  CalibrationVerdict verdict = CalibrationVerdict::kTooFewFrames;
  std::optional<Rig> rig;             ///< given with kOk; with the exposures that were found or kept
  std::optional<WheelBelief> wheels;  ///< given with kOk if the problem has wheels; the radius is the mean of both
  std::vector<CalibratedParameter> parameters;
  /// Covariance of `after` of all parameters, in their order, derived ones included. A parameter that is not observed
  /// has the variance of its prior.
  Eigen::MatrixXd covariance;
  /// Shifts of the landmarks that were seen, in the map's order; empty where the map is trusted.
  std::vector<LandmarkShift> landmark_shifts;
  Eigen::MatrixXd landmark_covariance;  ///< joint, m^2: x and y of each of landmark_shifts
  std::vector<Landmark> landmarks;      ///< those of the problem, with the estimated places, tops and radii
  /// Joint covariance of all that is believed afterwards, of what was found and of what was kept: the rig's numbers
  /// (RigNumber; the upper view's azimuth and offset are its own), then the kLandmarkNumbers of each of `landmarks`,
  /// then the wheels' mean radius (m), their ratio and their separation (m), then the TimeNumbers (s). A number that
  /// was taken as exact has variance 0.
  Eigen::MatrixXd belief_covariance;
  static constexpr int kWheelNumbers = 3;
  /// x m, y m, heading rad in the world for each frame of the problem: the pose at which its lower image with
  /// late_s = 0 was taken (earlier than the frame's time by the latency). Empty: the frame was dropped.
  std::vector<std::optional<Eigen::Vector3d>> poses;
  std::vector<SightingResidual> residuals;
  std::size_t frames_used = 0;
  std::size_t frames_dropped = 0;  ///< they show fewer than two landmarks, or no pose explains their sightings
  std::size_t outliers = 0;
  /// Square root of the sightings' reduced chi-squared: their scatter over their stated sigma. All sigmas are scaled by
  /// it where it is above 1: a part of what a sighting states is an error that its frames share.
  double sighting_scale = 0;
  /// Standard deviation of the error that sightings of one landmark in one view share, as
  /// CalibrationProblem::systematic_px.
  double systematic_px = 0;
  /// As sighting_scale, for the wheels. 0: no wheels.
  double wheel_scale = 0;
  /// Root mean square of the residuals' coordinates without outliers: lower view, upper view.
  std::array<double, 2> rms_before_px{};
  std::array<double, 2> rms_after_px{};
  std::array<std::size_t, 2> sightings{};
};

/// Returns whether this build has Ceres.
bool can_calibrate();

/// Estimates the parameters of the rig and of the wheels from a drive among known landmarks, by bundle adjustment.
///
/// Unknowns: for each frame the pose (x, y, heading) and the relative slip of both wheels since the last frame (a
/// Gauss-Markov process); for each view centre, rim radius in pixels, tilt, apex angle, mirror radius R and distance d;
/// lens height; mirror separation; the lower view's azimuth and offset, and the upper view's relative to them; the
/// wheels' mean radius, the ratio of right to left radius, and their separation.
/// A further unknown is the bias of the sightings of each landmark, of each of sixteen rings of the image, and of each
/// landmark in each ring.
/// Where they are uncertain: the landmarks' places, tops and radii. On request: the times of exposure. Data: whitened
/// pixels of near points; the motion measured by the wheels; rim circles; the priors.
///
/// Observability:
/// * r_m, R and d enter as v = (d / R + cot a) r_m. Landmarks determine v; only the rim circle determines r_m, and with
///   it R.
/// * Tops of one height determine v (top - lens - d) as one number: v and the lens height are separated by the prior of
///   the latter, or by tops of different heights. d (~ 1 / (rho + d)^2) and the apex (constant in h) are separated from
///   it by a spread of ranges.
/// * Centre and tilt shift an image alike, by c and v t, but turn bearings by c / h and t h / v: landmarks in all
///   directions separate them.
/// * Both azimuths together, and both offsets together, are a choice of the body frame. Only the wheels determine them:
///   the azimuth by driving straight, the offsets by driving curves. Therefore the upper view's values are relative to
///   the lower view's.
/// * Skew and readout move a landmark's image by the body's motion in that time: changing speed and turn rate separate
///   them from the upper view's azimuth and offset and from tilts. Latency shifts both ends of the wheels' motion
///   alike: a drive at one speed along one arc does not determine it.
/// * If landmarks are not trusted, only their priors, or the first pose where it is given, determine their common
/// translation
///   and rotation, and only the mirrors' sizes, the wheels' radius, the heights and measured distances determine their
///   common scale.
///
/// For a sighting taken tau after its frame's time, the pose is moved along the frame's twist by tau, on the chord of
/// the arc. This neglects (omega tau)^2 / 24 of the distance, and a tau^2 / 2 for a change of speed a: 0.2 mm at
/// 0.5 m/s^2 and 25 ms. In the wheels' rows the poses at both ends are moved in this way by the latency; with
/// fit_timing a row is left out if one of its ends has no twist.
///
/// A parameter that the data determine less well than its prior is held at the prior, the worst first. It then counts,
/// as does a lens that is not estimated, as an uncertain constant in the sigmas of the others ("consider" covariance:
/// Schmidt 1966; Bierman 1977, ch. 8). Outliers are found with a Cauchy loss whose scale shrinks. Then sightings beyond
/// kOutlierSigmas are left out, and the rest is solved by plain least squares.
/// @throws std::invalid_argument naming each value outside its domain: a landmark's index, place, top or radius, a
/// pixel that is not finite, a covariance that is not positive definite, priors and wheels that are not > 0, wheel
/// readings that are not finite or run backwards, twists and times that are not finite, a rim's circle or sigmas, a
/// systematic_px, distortion_sigma or height_px that is not >= 0, a start pose that is not finite, its
/// covariance that is not positive definite, a distance or its sigma that is not > 0 or is not between two landmarks
CalibrationResult calibrate(const CalibrationProblem& problem);

/// A landmark's shift minus the shift that the best common translation, rotation and scale of the other landmarks
/// (unweighted least squares, first order) gives it. So it does not change if the map as a whole lies elsewhere, or if
/// the map was measured with another ruler, which only the wheels' radius and the heights could contradict.
struct RelativeShift {
  LandmarkShift shift;     ///< the remainder and its covariance
  double chi_squared = 0;  ///< of the remainder; with two degrees of freedom if the landmark has not moved
  bool moved = false;      ///< chi_squared is above the limit
};

/// Compares each landmark of the result with the others that have not moved, in the result's order. A moved landmark
/// biases the common shift of the others and makes them seem moved. So while four or more count as unmoved, the one
/// with the greatest chi-squared is removed from them if it exceeds the limit. Of three landmarks, the test cannot
/// identify the moved one: all may be above the limit. Fewer than three cannot be tested, and the answer is empty.
/// @param landmarks those of the problem
/// @param chi_squared_limit exp(-limit / 2) is the false-alarm rate for one landmark
std::vector<RelativeShift> shifts_among(const CalibrationResult& result, const std::vector<Landmark>& landmarks,
                                        double chi_squared_limit);

/// In sigmas that sightings state, or in those that they have if these are greater. One in 25,000 Gaussian sightings
/// lies beyond it.
constexpr double kOutlierSigmas = 4.5;

}  // namespace twocone::vision
