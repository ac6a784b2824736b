// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "vision/calibration.h"
#include "vision/uncertain_rig.h"

/// The bundle adjustment of a calibration: its rows and numbers, its solver, and the steps from a problem to its
/// answer.
namespace twocone::vision::calibration {

/// The numbers that all frames share: those of the rig (RigNumber), then these. The upper view's azimuth and offset are
/// relative to the lower one's. Latency and skew are Rig::exposures in another form: how much earlier than its stamp
/// the lower view is exposed, and how much later than that the upper view is.
enum SharedNumber : int {
  kWheelRadius = kRigNumbers,
  kWheelRatio,
  kWheelSeparation,
  kLatency,
  kSkew,
  kLowerReadout,
  kUpperReadout,
  kSharedNumbers
};
using Shared = Eigen::Matrix<double, kSharedNumbers, 1>;

/// By LandmarkNumber.
using LandmarkVector = Eigen::Matrix<double, kLandmarkNumbers, 1>;
inline LandmarkVector numbers_of(const Landmark& l) { return {l.x_m, l.y_m, l.top_m, l.radius_m}; }
inline LandmarkVector sigmas_of(const Landmark& l) {
  return {l.sigma.x_m, l.sigma.y_m, l.sigma.top_m, l.sigma.radius_m};
}

/// The constants of a view, which are not estimated.
struct ViewConstants {
  double sense = 1;  ///< -1 where the view is mirrored
  bool has_lens = false;
  Eigen::Vector2d focal_px = Eigen::Vector2d::Ones();
  Eigen::Vector2d principal_px = Eigen::Vector2d::Zero();
  std::array<double, 6> further{};  ///< p1 p2 k3 k4 k5 k6
  std::size_t lens_terms = 4;
};

/// The prior of the shared numbers, which also gives their scale: number = mean + sigma * unknown.
struct SharedModel {
  Shared mean = Shared::Zero();
  Shared sigma = Shared::Zero();
  std::vector<int> fixed;  ///< numbers that are not estimated; their sigma is 0 where they are exact
  /// Covariance of the unknowns that are held: those of one belief are not independent of each other.
  Eigen::MatrixXd held_covariance = Eigen::MatrixXd::Identity(kSharedNumbers, kSharedNumbers);
  std::array<ViewConstants, 2> views;
  bool has_wheels = false;
  WheelBelief wheels;  ///< used for the wheels' noise

  explicit SharedModel(const CalibrationProblem& problem);

  [[nodiscard]] Shared numbers(const Shared& unknowns) const { return mean + sigma.cwiseProduct(unknowns); }
};

MirrorView to_view(const SharedModel& model, const Shared& numbers, const MirrorViewSettings& like, Side side);
std::array<ExposureTimes, 2> to_exposures(const Shared& numbers);
std::string name_of(int shared_number);

struct SightingRow {
  std::size_t frame;           ///< index into BundleState::poses
  std::size_t landmark_index;  ///< into BundleState::landmarks
  Landmark landmark;
  BodyTwist twist;
  double late_s = 0;
  double readout_share = 0;  ///< share of the readout time after the middle row
  Eigen::Vector2d pixel_px;
  Eigen::Matrix2d whitener;  ///< W with W covariance W^T = 1
  /// Groups of sightings with a shared error, as indices into BundleState::biases: those of one landmark in one view,
  /// those at about one radius in one view, and those that are both.
  std::array<std::size_t, 3> groups{};
  Side side;
  bool used = true;
  Eigen::Matrix2d axes = Eigen::Matrix2d::Identity();  ///< columns: outwards from the tip, and at a right angle to it
};

/// The motion from one frame to the next, as the wheels measured it.
struct WheelRow {
  std::size_t frame;  ///< the frame at its end; it starts at the previous one
  std::vector<Eigen::Vector2d> turns_rad;
  Eigen::Matrix3d whitener;  ///< of (x, y, heading) relative to the previous frame, for errors other than the slips
  bool follows = false;      ///< the previous interval has a row too, which is the previous one in the list
  double slip_share = 0;     ///< mean of this interval's slip, given the last interval's: slip_share * last
  double slip_sigma = 1;     ///< standard deviation of that slip; both in units of WheelBelief::slip
  BodyTwist from_twist, to_twist;
};

struct RimRow {
  Side side;
  RimMeasurement rim;
};

struct BundleData {
  SharedModel model;
  std::vector<SightingRow> sightings;
  std::vector<WheelRow> wheels;
  std::vector<RimRow> rims;
  std::size_t groups = 0;
  bool moves_landmarks = false;  ///< whether a number of a landmark is uncertain
  /// The measured pose of the first frame, and W with W covariance W^T = 1.
  struct FirstPose {
    Eigen::Vector3d pose;
    Eigen::Matrix3d whitener;
  };
  std::optional<FirstPose> first_pose{};
  struct DistanceRow {
    MeasuredDistance measured;
    Landmark from, to;
  };
  std::vector<DistanceRow> distances{};
  /// For each landmark the distance to which the prior of its radius is in proportion; its sigma is the radius's, in
  /// that proportion. Empty: the radius is known as a length.
  std::vector<std::optional<DistanceRow>> radius_scales{};
};

struct BundleState {
  Shared unknowns = Shared::Zero();
  std::vector<Eigen::Vector3d> poses;     ///< x m, y m, heading rad
  std::vector<Eigen::Vector2d> slips;     ///< left and right slip of each wheel row, in units of WheelBelief::slip
  std::vector<Eigen::Vector2d> biases;    ///< of each group, px, along its sightings' axes
  std::vector<LandmarkVector> landmarks;  ///< shifts of their numbers, in the sigmas of each
};

struct BundleSettings {
  std::vector<int> held;      ///< shared numbers that are constant
  bool hold_all = false;      ///< only the poses are estimated, without the wheels
  double sighting_scale = 1;  ///< factor of the stated sigma
  double wheel_scale = 1;
  double systematic_px = 0;             ///< standard deviation of the biases; 0: there are none
  std::optional<double> cauchy_sigmas;  ///< scale of the sightings' Cauchy loss; empty: squares
};

/// Solves the least-squares problem, starting from `state`; returns false where there is no answer.
bool minimise(const BundleData& data, const BundleSettings& settings, BundleState& state);

/// Returns the information (inverse covariance) of all shared unknowns at `state`, followed by the kLandmarkNumbers of
/// each landmark where one is uncertain (BundleData::moves_landmarks). Priors are included; poses, slips and biases are
/// eliminated. Unknowns of sigma 0 have the prior's rows only.
Eigen::MatrixXd shared_information(const BundleData& data, const BundleSettings& settings, const BundleState& state);

/// Returns the sum of squares of the wheel rows' residuals, including those of the slips.
double wheel_chi_squared(const BundleData& data, const BundleState& state);

/// Returns measured minus predicted pixel; the bias is a part of it.
Eigen::Vector2d residual_px(const BundleData& data, const SightingRow& row, const BundleState& state);

bool has_solver();

// ---- from the problem to its rows

/// Checks the arguments of calibrate(). @throws std::invalid_argument as calibrate() states
void check(const CalibrationProblem& problem);

/// The problem as rows, with their origins in the problem.
struct Bundle {
  BundleData data;
  BundleState start;
  std::vector<SightingResidual> origins;  ///< of data.sightings, in their order
  std::vector<std::size_t> frames;        ///< of start.poses: index into the problem's frames
};

/// Makes the rows. Frames without a start pose are left out; their wheel readings then belong to the next frame's
/// motion.
Bundle bundle_of(const CalibrationProblem& problem);

/// Returns whether sightings, or pointers to them, are of more than one landmark.
/// @param landmark their member that identifies the landmark
template <typename Sightings, typename Landmark>
bool show_two_landmarks(const Sightings& sightings, Landmark landmark) {
  return std::ranges::adjacent_find(sightings, std::ranges::not_equal_to{}, landmark) != sightings.end();
}

/// Returns the variance of the mean of a Gauss-Markov process of variance 1 over `x` time constants. It is that of a
/// wheel's slip over an interval.
double mean_slip_variance(double x);

// ---- from the solution to the answer

/// Chooses the shared numbers to hold at their priors. The first is the one that the data determine worst relative to
/// its prior, then the next with that one held, until the data determine each of the others at least as well as its
/// prior does. @param information from shared_information(); landmarks behind the shared numbers are never held
std::vector<int> unobserved(const Eigen::MatrixXd& information, const SharedModel& model);

/// Returns the covariance of the unknowns when those of `held` stay at their priors.
/// @param held_covariance of all shared unknowns; used for those of `held`
Eigen::MatrixXd consider_covariance(const Eigen::MatrixXd& information, const std::vector<int>& held,
                                    const Eigen::MatrixXd& held_covariance);

/// Fills in parameters, derived numbers last, and covariance.
/// @param covariance of the unknowns; landmarks may follow the shared numbers
void take_parameters(const SharedModel& model, const Shared& unknowns, const Eigen::MatrixXd& covariance,
                     const std::vector<int>& held, CalibrationResult& result);

/// Returns the landmarks with at least one used sighting, in the map's order.
std::vector<std::size_t> seen_landmarks(const BundleData& data);

/// Fills in landmark_shifts and landmark_covariance.
/// @param covariance of the unknowns; the landmarks follow the shared numbers
void take_landmark_shifts(const std::vector<Landmark>& landmarks, const BundleState& state,
                          const Eigen::MatrixXd& covariance, const std::vector<std::size_t>& seen,
                          CalibrationResult& result);

/// Fills in landmarks and belief_covariance. @param covariance as above
void take_belief(const SharedModel& model, const std::vector<Landmark>& landmarks, const BundleState& state,
                 const Eigen::MatrixXd& covariance, CalibrationResult& result);

}  // namespace twocone::vision::calibration
