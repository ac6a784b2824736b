// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <unistd.h>

#include "twocone/twocone.h"

/// The public interface (include/twocone) for Python: each object may be used from several threads and be closed in any
/// order, and a forked process neither uses nor ends what its parent has opened.
namespace twocone::python {

/// An object that belongs to the process which made it: its threads, devices and programs do not exist in a fork.
template <typename T>
class OfThisProcess {
 public:
  explicit OfThisProcess(T value) : value_(std::make_unique<T>(std::move(value))) {}
  OfThisProcess(OfThisProcess&&) noexcept = default;
  ~OfThisProcess() {
    // A destructor would wait for threads of the parent, and command its devices.
    if (::getpid() != process_) static_cast<void>(value_.release());
  }
  /// @throws FailureError in another process
  T& get();

 private:
  std::unique_ptr<T> value_;
  pid_t process_ = ::getpid();
};

/// A frame, whose images are arrays without a copy.
class PyFrame {
 public:
  explicit PyFrame(CapturedFrame frame) : frame_(std::move(frame)) {}
  enum class Side { kLower, kUpper };
  /// Waits for an image, and returns its pixels as a read-only array that keeps `self` alive.
  static pybind11::array image(const std::shared_ptr<PyFrame>& self, Side side);
  CapturedFrame& frame() { return frame_.get(); }

 private:
  OfThisProcess<CapturedFrame> frame_;
  std::mutex mutex_;  // serialises the waits for pixels, which keep what they have converted
};

/// An opened robot.
class PyRobot {
 public:
  PyRobot(const std::filesystem::path& robot_file, std::uint64_t seed);
  ~PyRobot();
  PyRobot(const PyRobot&) = delete;
  PyRobot& operator=(const PyRobot&) = delete;

  [[nodiscard]] const RobotDescription& description() const { return description_; }
  std::shared_ptr<PyFrame> next_frame(double timeout_s);
  Velocity set_velocity(double forward_mps, double turn_radps);
  std::optional<Pose> true_pose();
  std::string contact();
  /// Stops the wheels and closes the devices. A call that waits in another thread ends with kCancelled.
  void close() noexcept;
  [[nodiscard]] bool is_closed() const { return *is_closing_; }

 private:
  /// Calls f(robot) without the interpreter's lock, one call at a time.
  template <typename F>
  auto use(F f);

  RobotDescription description_;
  /// Shared with the frames, which may outlive the robot.
  std::shared_ptr<std::atomic<bool>> is_closing_ = std::make_shared<std::atomic<bool>>(false);
  std::mutex mutex_;
  std::optional<OfThisProcess<ConnectedRobot>> robot_;
  pid_t process_ = ::getpid();
};

void add_robot(pybind11::module_& module);
void add_localiser(pybind11::module_& module);

}  // namespace twocone::python
