// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "hal/camera.h"

/// What every Camera must do, whatever stands behind it. To put a new backend through it, write down a CameraCase and
/// instantiate the suites, as memory_conformance_test.cpp does; camera_conformance_test.cpp holds the tests.
namespace twocone::test {

/// What makes a camera's next frame come.
enum class FramesCome {
  kByWaiting,   ///< real time: a grab waits until the frame is due
  kByGrabbing,  ///< lock-step: a grab moves the camera's time on to the next frame
  kByPassing,   ///< only when the test lets time pass
};

struct OpenedCamera {
  std::unique_ptr<Camera> camera;
  /// Lets so much time pass on the camera's clock, without a grab; empty where only a grab can.
  std::function<void(std::chrono::nanoseconds)> pass;
};

struct CameraCase {
  std::string name;  ///< of letters and digits
  FramesCome frames_come = FramesCome::kByWaiting;
  CameraSettings settings{64, 48, 15};  ///< that the backend can do, or nearly; small and quick
  /// Exposure times may be off a whole number of periods by this: 0 for a computed time, jitter for a measured one.
  std::chrono::nanoseconds jitter{0};
  std::function<OpenedCamera()> open;  ///< a fresh, closed camera
};

inline void PrintTo(const CameraCase& camera_case, std::ostream* os) { *os << camera_case.name; }

inline std::string camera_case_name(const testing::TestParamInfo<CameraCase>& tested) { return tested.param.name; }

/// For every backend.
class CameraConformance : public testing::TestWithParam<CameraCase> {
 protected:
  void SetUp() override { reopen(); }

  void reopen() { opened_ = GetParam().open(); }
  void start(const CameraSettings& settings);
  void start() { start(GetParam().settings); }

  /// The next frame, however it has to be made to come.
  Result<Frame> next();

  Camera& camera() { return *opened_.camera; }

  OpenedCamera opened_;
  CameraSettings applied_;
};

/// For those whose frames go by unless they are grabbed: `pass` must be there.
class CameraThatDoesNotWait : public CameraConformance {};

/// For those that are kByGrabbing.
class CameraInLockStep : public CameraConformance {};

}  // namespace twocone::test
