// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

/// Types that the headers of twocone share. They require only the standard library.
///
/// Frames: the world is the map's frame, with x and y in metres on the floor and headings counter-clockwise from x. The
/// body frame has x forward and y to the left. Its origin is midway between the wheels, on the mirrors' axis.
namespace twocone {
inline namespace v1_0 {

/// Kinds of failure. There is one kind for each different way in which a caller can react.
enum class FailureCode {
  kNotFound,      ///< no such device, file or driver: check the name
  kUnavailable,   ///< known, but not in this build or not on this machine: install it or plug it in
  kInvalidState,  ///< the call is not allowed now
  kTimeout,       ///< nothing arrived before the deadline: it is safe to try again
  kDisconnected,  ///< the device or its program is gone: open the robot again
  kBadData,       ///< bytes arrived, but they are not an image or reply
  kCancelled,     ///< a signal or the program requested the end (OpenOptions)
  kRefused,       ///< the device or its program rejects the request, and the message says why
};

/// A code to branch on and one sentence for a person.
struct Failure {
  FailureCode code = FailureCode::kRefused;
  std::string message;
};

/// A value, or the reason why there is none. Access to a missing value throws std::logic_error with the reason.
template <typename T>
class [[nodiscard]] Expected {
 public:
  // Both conversions are implicit on purpose, for `return value;` and `return Failure{...};`.
  Expected(T value) : content_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  // NOLINTNEXTLINE(google-explicit-constructor)
  Expected(Failure failure) : content_(std::in_place_index<1>, std::move(failure)) {}

  explicit operator bool() const { return content_.index() == 0; }
  [[nodiscard]] const T& operator*() const { return check(), std::get<0>(content_); }
  [[nodiscard]] T& operator*() { return check(), std::get<0>(content_); }
  const T* operator->() const { return &**this; }
  T* operator->() { return &**this; }
  /// Returns the failure. Requires a result without a value.
  [[nodiscard]] const Failure& error() const { return std::get<1>(content_); }

 private:
  void check() const {
    if (content_.index() != 0) throw std::logic_error(std::get<1>(content_).message);
  }
  std::variant<T, Failure> content_;
};

/// A pose in the world.
struct Pose {
  double x_m = 0, y_m = 0;
  double heading_rad = 0;  ///< (-pi, pi]
};

/// The covariance of (x m, y m, heading rad): 3 x 3, row by row.
using PoseCovariance = std::array<double, 9>;

/// The reason why a position is given or withheld.
enum class FixVerdict {
  kOk,
  kGap,            ///< given by method paper, although two of its circles did not meet
  kAmbiguous,      ///< two positions explain the measurements equally well; none is given
  kTooFew,         ///< fewer measurements than a position requires; none is given
  kWeak,           ///< given, but one direction is not determined: see the covariance
  kContradictory,  ///< the measurements contradict each other; none is given
  kOutOfBounds,    ///< the measurements give a position outside the map's bounds; none is given
};

/// A position from one frame. Fields without an answer are empty.
struct PoseAnswer {
  FixVerdict verdict = FixVerdict::kTooFew;
  std::optional<Pose> pose;
  std::optional<PoseCovariance> covariance;  ///< where the method states one
};

}  // namespace v1_0
}  // namespace twocone
