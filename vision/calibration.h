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
/// seen in. Data: whitened pixels of near points; the way that the wheels tell; rim circles; the priors.
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
///
/// A parameter that the data tell less well than its prior did is held at it, the worst first; it then counts as an
/// uncertain constant in the others' sigmas ("consider" covariance: Schmidt 1966; Bierman 1977, ch. 8).
/// Outliers: Cauchy's loss with a shrinking scale; what then lies beyond kOutlierSigmas is left out and the rest solved
/// by plain least squares.
/// @throws std::invalid_argument naming what lies outside its domain: a landmark's index, a covariance that is not
/// positive
///   definite, priors and wheels that are not > 0, wheel readings that are not finite or run backwards
CalibrationResult calibrate(const CalibrationProblem& problem);

/// Of sightings that belong to a Gaussian of the sightings' own scale one in 25,000 lies beyond.
constexpr double kOutlierSigmas = 4.5;

}  // namespace twocone::vision
