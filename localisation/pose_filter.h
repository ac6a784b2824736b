// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/odometry.h"

namespace twocone::localisation {

/// The noise of the wheels.
struct OdometryNoise {
  /// Relative standard deviation of each wheel's travel (slip, wrong radius), correlated over `correlation_s`.
  double slip = 0.01;          ///< >= 0
  double correlation_s = 2.0;  ///< > 0
  double angle_rad = 0.006;    ///< of one reading of a wheel's angle: a 1024-count encoder's step, > 0
};

/// The filter's estimate, world frame.
struct PoseEstimate {
  Pose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< of x (m), y (m), heading (rad)
};

/// The filter's state.
enum class FilterState {
  kLost,      ///< no fix yet, or the last fix contradicts it: the estimate is odometry since the last trusted one
  kTracking,  ///< fixes and odometry agree
};

/// Returns the name in track.csv: lost, tracking.
std::string_view to_string(FilterState state);

/// How the filter used a fix.
enum class FixUse {
  kStarted,      ///< the estimate starts with it
  kTaken,        ///< fused with the estimate; for kWeak and a fix without heading, the observed part only
  kRelocated,    ///< the last of several that show the robot elsewhere: the estimate continues from them
  kNoFix,        ///< there is no position
  kNoSigma,      ///< it has no valid covariance (kWeak: no valid measurements)
  kOutOfBounds,  ///< the robot cannot be there
  kUnexpected,   ///< farther from the odometry's position than chance explains
  kUndecided,    ///< both of two answers are expected
  kNotGaussian,  ///< kWeak: the distribution after it would be no ellipse
  kCannotStart,  ///< it gives a part of the pose, and there is no estimate yet to complete it
};
/// Returns the name in track.csv: started, taken, relocated, no_fix, no_sigma, out_of_bounds, unexpected, undecided,
/// not_gaussian, cannot_start.
std::string_view to_string(FixUse use);

/// The Kalman filter of one hypothesis of the robot's pose; PoseFilter holds up to two of them.
///
/// State: x, y, heading; the relative slip of the left and right wheel (each wheel's travel is r dphi (1 + slip), slip
/// is a first-order Gauss-Markov process); the errors of the last reading of both wheels' angles; the bend. A reading's
/// error affects two intervals, the end of one and the beginning of the next, with opposite signs. With this error in
/// the state, the readings' noise does not add up to a random walk.
///
/// The bend is the second-order effect of an unknown heading. With an error t of the heading, a path of length d ends t
/// d beside the arc and t^2 d / 2 short of it. This is a chi-squared number that stays the same from step to step, so
/// its share of the path adds up. The bend is a state of variance 1 that shortens each path by kBend sigma_heading^2 d.
///
/// It is a Schmidt-Kalman ("consider") filter of the shared errors (Schmidt 1966; Bierman 1977, ch. 8): they are not
/// estimated, but the correlation of the state with them is kept. So they do not average away over frames, and a fix is
/// compared with the estimate without the part of the error that both have. Without shared errors it is the extended
/// Kalman filter.
class PoseHypothesis {
 public:
  using Vector = Eigen::Matrix<double, 8, 1>;
  using Matrix = Eigen::Matrix<double, 8, 8>;

  /// Twice the root mean square of t^2 / 2 over sigma^2 (sqrt(3) / 2), since its tail is longer than a Gaussian's. With
  /// this value, regions of 99.9 % contain the truth in 99.5 % at least, and those of 50 % in more than 50 %
  /// (pose_filter_extremes_test.cpp).
  static constexpr double kBend = 1.7320508075688772;

  /// Starts from `start`; slips and reading errors have the sigmas of `noise`.
  /// @param by_shared of the start's estimated minus true pose; its part of `start.covariance`
  /// @throws std::invalid_argument for a pose that is not finite and a matrix that is no covariance (is_covariance)
  PoseHypothesis(const PoseEstimate& start, const OdometryNoise& noise, const BySharedErrors<3>& by_shared = {});

  /// Predicts the pose after the wheels turned by these angles since the last call, in `dt_s` >= 0. The pose moves
  /// along the exact arc (drive_arc).
  /// @param wheels_by_shared as for PoseFilter
  /// @throws std::invalid_argument where pose or covariance exceed the range of doubles; nothing is changed then
  void predict(double dt_s, double left_rad, double right_rad, const WheelGeometry& wheels, const OdometryNoise& noise,
               const BySharedErrors<3>& wheels_by_shared = {});

  /// A measured pose, or a measured position.
  struct Measurement {
    Eigen::Vector3d pose = Eigen::Vector3d::Zero();        ///< x, y, heading
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< a covariance, of the position at least
    bool has_heading = false;
    Eigen::Matrix3d own_covariance = covariance;  ///< the part that does not come from shared errors
    BySharedErrors<3> by_shared{};                ///< of measured minus true pose

    [[nodiscard]] int rows() const { return has_heading ? 3 : 2; }
  };
  /// Returns whether the difference from the measurement is inside the 1 - kGate ellipse.
  [[nodiscard]] bool expects(const Measurement& m) const;
  /// Updates by a measurement in Joseph's form, (I - K H) P (I - K H)^T + K R K^T without shared errors, which stays
  /// symmetric and positive in spite of K's rounding.
  /// @returns false, with nothing changed, where numbers differ so much in size that rounding leaves no valid
  /// covariance
  [[nodiscard]] bool correct(const Measurement& m);
  /// Updates by a measured pose whose errors may be those of earlier ones, by covariance intersection of the two poses
  /// (Julier and Uhlmann 1997): their weights are the ones that make the determinant least. So the pose is never more
  /// certain than by the better of the two, in any direction by which they are alike.
  /// @param m has a heading. @returns as correct()
  [[nodiscard]] bool intersect(const Measurement& m);
  /// Updates by the measurements of a weak fix (least_squares/posterior.h); nothing is changed except for kTaken.
  /// @returns kTaken, kUnexpected, kNotGaussian or kNoSigma
  FixUse correct(const Fix& weak);

  [[nodiscard]] PoseEstimate estimate() const;
  [[nodiscard]] const Matrix& covariance() const { return covariance_; }

 private:
  using Rows = Eigen::Matrix<double, 3, 8>;
  using Cross = Eigen::Matrix<double, 8, Eigen::Dynamic>;
  /// Three numbers that depend on the state: measured minus expected = slopes (true - estimated state) + own noise +
  /// by_shared times the shared errors. Unused rows have zero slopes, zero difference and unit noise.
  struct Linear {
    Rows slopes = Rows::Zero();
    Eigen::Vector3d difference = Eigen::Vector3d::Zero();
    Eigen::Matrix3d own_covariance = Eigen::Matrix3d::Identity();
    BySharedErrors<3> by_shared;
  };
  [[nodiscard]] Linear linear(const Measurement& m) const;
  /// Returns the covariance of Linear::difference.
  [[nodiscard]] Eigen::Matrix3d spread(const Linear& l) const;
  [[nodiscard]] bool update(const Linear& l);
  void count_shared_errors(Eigen::Index count);

  Vector state_ = Vector::Zero();
  Matrix covariance_ = Matrix::Identity();
  Cross by_shared_{};  ///< of estimated minus true state
};

/// Fuses odometry with the fixes of single frames, for method `outline`, estimate.tum and track.csv. The fixes
/// themselves do not change.
///
/// It is an extended Kalman filter (PoseHypothesis). Frames without a fix are predicted only. A fix outside the
/// 1 - kGate ellipse of the difference is not taken, and the filter is lost until a fix is expected again. A robot that
/// was carried elsewhere is found by a second hypothesis, which starts with the first of the unexpected fixes: when
/// kRelocateAfter in a row agree with it, the filter continues from them. Each of those fixes must be checked by two
/// degrees of freedom of its own, as given by three landmarks. Fixes with fewer, such as from two landmarks, must also
/// turn as the wheels did. The reason is that a mirrored or wrongly labelled pair agrees with itself while the robot
/// stands or drives straight on.
///
/// Use of the verdicts: kOk is taken; without a heading, as a position only. kAmbiguous is taken if exactly one of its
/// answers is inside the gate. For kWeak, the measurements are taken about the filter's own position, and only if an
/// ellipse can represent the result (least_squares/posterior.h). Of these three, only kOk with a heading can start the
/// filter or contradict it. A fix without covariance, and the other verdicts, are not used.
///
/// The errors that fixes share from frame to frame, those of rig and map, do not average away (PoseHypothesis). Those
/// of a robot that stands still and sees the same pixels are taken as independent.
class PoseFilter {
 public:
  static constexpr int kRelocateAfter = 3;
  /// The probability that a correct fix is not expected.
  static constexpr double kGate = 1e-6;

  /// Makes a filter that is lost until the first fix. @throws std::invalid_argument naming every bad field
  /// @param wheels_by_shared of the relative errors of the left and of the right wheel's radius (true over believed,
  /// minus 1), and of the error of the wheels' separation (true minus believed, m)
  PoseFilter(const WheelGeometry& wheels, const OdometryNoise& noise, BySharedErrors<3> wheels_by_shared = {});

  /// Predicts the pose from the wheels' total angles at a time. The first call sets the zero.
  /// @throws std::invalid_argument for angles or times that are not finite, a time before the last one, and a distance
  /// beyond the range of doubles; nothing is changed then
  void predict(double t_s, double left_rad, double right_rad);
  /// Corrects the pose by the fix of the frame whose angles were given to predict() last. @returns how the fix was used
  FixUse correct(const Fix& fix);

  /// Corrects the pose by one that comes from another source, whose errors are correlated in an unknown way over frames
  /// (PoseHypothesis::intersect). It can start the filter, but not contradict it: one that is not expected is not used,
  /// and none is while the filter is lost.
  /// @param covariance of x, y and heading
  /// @returns kStarted, kTaken, kUnexpected, kNoSigma; kUndecided: the filter is lost
  FixUse correct_by_second_source(const Pose& pose, const Eigen::Matrix3d& covariance);

  [[nodiscard]] FilterState state() const { return state_; }
  /// Returns the estimate; nothing before the first fix.
  [[nodiscard]] std::optional<PoseEstimate> estimate() const;

 private:
  using Measurement = PoseHypothesis::Measurement;
  /// @param is_checked whether the fix has kCheckedBy degrees of freedom or more
  FixUse correct_by_pose(const Measurement& m, bool is_checked);
  /// Updates the hypotheses that expect the position. A position alone cannot start a hypothesis.
  FixUse correct_by_position(const Measurement& m);
  FixUse correct_by_one_of(const Measurement& one, const Measurement& other);

  WheelGeometry wheels_;
  OdometryNoise noise_;
  BySharedErrors<3> wheels_by_shared_;
  FilterState state_ = FilterState::kLost;
  std::optional<PoseHypothesis> believed_;
  /// A hypothesis that an unexpected fix started.
  struct Elsewhere {
    PoseHypothesis hypothesis;
    Measurement first;
    int fixes = 1;
    int checked = 0;
    double turned_rad = 0;    ///< turn by the wheels since the first fix
    double vague_rad = 0;     ///< sigma of that turn
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
