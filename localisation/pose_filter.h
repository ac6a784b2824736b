// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/odometry.h"

namespace twocone::localisation {

/// How far the wheels are believed.
struct OdometryNoise {
  /// Relative standard deviation of each wheel's way (slip, wrong radius), correlated over `correlation_s`.
  double slip = 0.01;          ///< >= 0
  double correlation_s = 2.0;  ///< > 0
  double angle_rad = 0.006;    ///< of one reading of a wheel's angle: a 1024-count encoder's step, > 0
};

/// What the filter believes, world frame.
struct PoseEstimate {
  Pose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< of x (m), y (m), heading (rad)
};

/// Why the filter says what it says.
enum class FilterState {
  kLost,      ///< no fix yet, or the last fix contradicts it: the estimate is odometry since the last trusted one
  kTracking,  ///< fixes and odometry agree
};

/// As in track.csv: lost, tracking.
std::string_view to_string(FilterState state);

/// What became of a fix.
enum class FixUse {
  kStarted,      ///< the estimate begins with it
  kTaken,        ///< fused with the estimate; of kWeak and of a fix without heading the part that it tells
  kRelocated,    ///< the last of those that show the robot elsewhere: the estimate goes on from them
  kNoFix,        ///< there is no position
  kNoSigma,      ///< it has no covariance (kWeak: no measurements) that means something
  kOutOfBounds,  ///< the robot cannot be there
  kUnexpected,   ///< farther from where the wheels have brought the robot than chance explains
  kUndecided,    ///< of two answers both are expected
  kNotGaussian,  ///< kWeak: what is known after it would be no ellipse
  kCannotStart,  ///< it tells a part of the pose, and there is no estimate yet to which that could be added
};
/// As in track.csv: started, taken, relocated, no_fix, no_sigma, out_of_bounds, unexpected, undecided, not_gaussian,
/// cannot_start.
std::string_view to_string(FixUse use);

/// The Kalman filter of one hypothesis of where the robot is; PoseFilter holds up to two of them.
///
/// State: x, y, heading; the relative slip of the left and right wheel (each wheel's way is r dphi (1 + slip), slip a
/// first-order Gauss-Markov process); the errors of the last reading of both wheels' angles; the bend. A reading's
/// error belongs to two ways, to the end of one and the beginning of the next, so it comes back out again: with it in
/// the state, the readings' noise does not add up to a random walk.
///
/// The bend is what the first order leaves out of a heading that is not known. By an error t of the heading a way d
/// ends t d beside the arc and t^2 d / 2 short of it, a chi-squared number that stays the same from step to step, so
/// that its share of the way adds up. It is a state of variance 1 that shortens each way by kBend sigma_heading^2 d.
class PoseHypothesis {
 public:
  using Vector = Eigen::Matrix<double, 8, 1>;
  using Matrix = Eigen::Matrix<double, 8, 8>;

  /// Twice the root mean square of t^2 / 2 over sigma^2 (sqrt(3) / 2), since its tail is longer than a Gaussian's: so
  /// regions of 99.9 % hold 99.5 % at least, and those of 50 % hold more than that (pose_filter_extremes_test.cpp).
  static constexpr double kBend = 1.7320508075688772;

  /// Certain of nothing but what `start` says.
  /// @throws std::invalid_argument for a pose that is not finite and a matrix that is no covariance (is_covariance)
  PoseHypothesis(const PoseEstimate& start, const OdometryNoise& noise);

  /// Wheels turned by these angles since the last call, in `dt_s` >= 0. The pose goes along the exact arc (drive_arc).
  /// @throws std::invalid_argument where pose or covariance are farther than numbers go; nothing is changed then
  void predict(double dt_s, double left_rad, double right_rad, const WheelGeometry& wheels, const OdometryNoise& noise);

  /// A measured pose, or a measured position.
  struct Measurement {
    Eigen::Vector3d pose = Eigen::Vector3d::Zero();        ///< x, y, heading
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< a covariance, of the position at least
    bool has_heading = false;

    [[nodiscard]] int rows() const { return has_heading ? 3 : 2; }
  };
  /// Whether the difference lies inside the 1 - kGate ellipse.
  [[nodiscard]] bool expects(const Measurement& m) const;
  /// Joseph's form, (I - K H) P (I - K H)^T + K R K^T, which stays symmetric and positive whatever K's rounding.
  /// @returns false, with nothing changed, where numbers are so far apart that rounding leaves no covariance
  [[nodiscard]] bool correct(const Measurement& m);
  /// By what a weak fix was made from (least_squares/posterior.h); unchanged but for kTaken.
  /// @returns kTaken, kUnexpected, kNotGaussian or kNoSigma
  FixUse correct(const Fix& weak);

  [[nodiscard]] PoseEstimate estimate() const;
  [[nodiscard]] const Matrix& covariance() const { return covariance_; }

 private:
  struct Difference {
    Eigen::Vector3d value;       ///< measured less expected; past the rows 0
    Eigen::Matrix3d covariance;  ///< past the rows the identity
  };
  [[nodiscard]] Difference difference(const Measurement& m) const;
  [[nodiscard]] bool become(const Vector& state, const Matrix& covariance);

  Vector state_ = Vector::Zero();
  Matrix covariance_ = Matrix::Identity();
};

/// Method `full`, estimate.tum and track.csv: odometry fused with the fixes of single frames, each of which stays what
/// it is.
///
/// An extended Kalman filter (PoseHypothesis). Frames without a fix are predicted through. A fix outside the 1 - kGate
/// ellipse of the difference is not taken, and the filter is lost until a fix is expected again. A robot that has been
/// carried elsewhere is found by a second hypothesis, which begins with the first of the unexpected fixes: when
/// kRelocateAfter in a row agree with it, the filter goes on from them. Those fixes must check themselves by two
/// degrees of freedom each, as three landmarks give them; with less, as of two landmarks, they must also turn as the
/// wheels did, since a mirrored or a wrongly labelled pair agrees with itself for as long as the robot stands or drives
/// straight on.
///
/// Of the verdicts: kOk is taken, without a heading as a position only. kAmbiguous is taken where just one of its
/// answers lies inside the gate. kWeak is taken by its measurements about the filter's own place, and only where an
/// ellipse can hold what is known then (least_squares/posterior.h). Those three start or contradict nothing by
/// themselves but for kOk with a heading. A fix without covariance, and the other verdicts, are not used.
///
/// The fixes' errors are taken as independent. What they share from frame to frame (a map, a rig that is wrong by a
/// hair, a robot that stands still before the same pixels) is not in the covariance.
class PoseFilter {
 public:
  static constexpr int kRelocateAfter = 3;
  /// How often a fix that is right is not expected.
  static constexpr double kGate = 1e-6;

  /// Lost until the first fix. @throws std::invalid_argument naming every bad field
  PoseFilter(const WheelGeometry& wheels, const OdometryNoise& noise);

  /// Takes the wheels' total angles at a time. The first call sets the zero. @throws std::invalid_argument for angles
  /// or times that are not finite, a time before the last one, and a way that is farther than numbers go; nothing is
  /// changed then
  void predict(double t_s, double left_rad, double right_rad);
  /// Takes the fix of the frame whose angles predict() was last given. @returns what became of it
  FixUse correct(const Fix& fix);

  [[nodiscard]] FilterState state() const { return state_; }
  /// Nothing before the first fix.
  [[nodiscard]] std::optional<PoseEstimate> estimate() const;

 private:
  using Measurement = PoseHypothesis::Measurement;
  /// @param is_checked by kCheckedBy degrees of freedom
  FixUse correct_by_pose(const Measurement& m, bool is_checked);
  /// A position alone, which may start nothing, into the hypotheses that expect it.
  FixUse correct_by_position(const Measurement& m);
  FixUse correct_by_one_of(const Measurement& one, const Measurement& other);

  WheelGeometry wheels_;
  OdometryNoise noise_;
  FilterState state_ = FilterState::kLost;
  std::optional<PoseHypothesis> believed_;
  /// Begun by a fix that was not expected.
  struct Elsewhere {
    PoseHypothesis hypothesis;
    Measurement first;
    int fixes = 1;
    int checked = 0;
    double turned_rad = 0;    ///< by the wheels, since the first
    double vague_rad = 0;     ///< sigma of that
    bool has_turned = false;  ///< a fix has shown that turn, and not its mirror image

    void turn(double left_rad, double right_rad, const WheelGeometry& wheels, const OdometryNoise& noise);
    [[nodiscard]] bool shows_turn(const Measurement& m) const;
  };
  std::optional<Elsewhere> elsewhere_;
  struct Reading {
    double t_s;
    double left_rad;
    double right_rad;
  };
  std::optional<Reading> last_;
};

}  // namespace twocone::localisation
