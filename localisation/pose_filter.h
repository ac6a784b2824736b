// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

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

/// The Kalman filter of one hypothesis of where the robot is; PoseFilter holds up to two of them.
///
/// State: x, y, heading; the relative slip of the left and right wheel (each wheel's way is r dphi (1 + slip), slip a
/// first-order Gauss-Markov process); the errors of the last reading of both wheels' angles. A reading's error belongs
/// to two ways, to the end of one and the beginning of the next, so it comes back out again: with it in the state, the
/// readings' noise does not add up to a random walk.
class PoseHypothesis {
 public:
  using Vector = Eigen::Matrix<double, 7, 1>;
  using Matrix = Eigen::Matrix<double, 7, 7>;

  /// Certain of nothing but what `pose` and its covariance say.
  PoseHypothesis(const PoseEstimate& start, const OdometryNoise& noise);

  /// Wheels turned by these angles since the last call, in `dt_s` >= 0. The pose goes along the exact arc (drive_arc).
  void predict(double dt_s, double left_rad, double right_rad, const WheelGeometry& wheels, const OdometryNoise& noise);

  /// A measurement of the pose's (x, y, heading) through the first `rows` rows of `view`: what = view * pose + error.
  struct Measurement {
    int rows = 0;                                          ///< 0 .. 3
    Eigen::Matrix3d view = Eigen::Matrix3d::Identity();    ///< rows of it
    Eigen::Vector3d pose = Eigen::Vector3d::Zero();        ///< measured x, y, heading
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of the measured pose
  };
  /// Whether the difference lies inside the 1 - kGate ellipse.
  [[nodiscard]] bool expects(const Measurement& m) const;
  /// Joseph's form, (I - K H) P (I - K H)^T + K R K^T, which stays symmetric and positive whatever K's rounding.
  void correct(const Measurement& m);

  [[nodiscard]] PoseEstimate estimate() const;
  [[nodiscard]] const Matrix& covariance() const { return covariance_; }

 private:
  struct Difference {
    Eigen::Vector3d value;       ///< measured less expected; past the rows 0
    Eigen::Matrix3d covariance;  ///< past the rows the identity
  };
  [[nodiscard]] Difference difference(const Measurement& m) const;

  Vector state_ = Vector::Zero();
  Matrix covariance_ = Matrix::Identity();
};

/// Method `full`, estimate.tum: odometry fused with the fixes of single frames, each of which stays what it is.
///
/// An extended Kalman filter (PoseHypothesis). Frames without a fix are predicted through. A fix outside the 1 - kGate
/// ellipse of the difference is not taken, and the filter is lost until a fix is expected again; when kRelocateAfter
/// such fixes in a row agree with one another (by odometry between them: a second hypothesis that began with the first
/// of them), the robot has been carried elsewhere, and the filter goes on from them.
///
/// Of the verdicts: kOk is taken, without a heading as a position only. kAmbiguous is taken where just one of its
/// answers lies inside the gate. kWeak is taken across its unseen direction only. Those three start or contradict
/// nothing by themselves but for kOk with a heading. A fix without covariance, and the other verdicts, are not used.
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
  /// or times that are not finite, and a time before the last one; nothing is changed then
  void predict(double t_s, double left_rad, double right_rad);
  /// Takes the fix of the frame whose angles predict() was last given.
  void correct(const Fix& fix);

  [[nodiscard]] FilterState state() const { return state_; }
  /// Nothing before the first fix.
  [[nodiscard]] std::optional<PoseEstimate> estimate() const;

 private:
  void correct_by_pose(const PoseHypothesis::Measurement& m);
  /// Takes a measurement that may start nothing, into the hypotheses that expect it.
  void correct_by_part(const PoseHypothesis::Measurement& m);

  WheelGeometry wheels_;
  OdometryNoise noise_;
  FilterState state_ = FilterState::kLost;
  std::optional<PoseHypothesis> believed_;
  std::optional<PoseHypothesis> elsewhere_;  ///< begun by a fix that was not expected
  int elsewhere_fixes_ = 0;
  struct Reading {
    double t_s;
    double left_rad;
    double right_rad;
  };
  std::optional<Reading> last_;
};

}  // namespace twocone::localisation
