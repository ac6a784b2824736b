// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "hal/camera.h"

/// The behaviour that every Camera must have, whatever its backend. To test a new backend, write a CameraCase and
/// instantiate the suites, as memory_conformance_test.cpp does; camera_conformance_test.cpp holds the tests.
namespace twocone::test {

struct OpenedCamera {
  std::unique_ptr<Camera> camera;
  /// Lets this time pass on the camera's clock, without a grab; empty if only a grab can.
  std::function<void(std::chrono::nanoseconds)> pass;
};

struct CameraCase {
  std::string name;                     ///< only letters and digits
  CameraSettings settings{64, 48, 15};  ///< small and fast settings that the backend can apply, at least nearly
  /// Capture times may differ from a whole number of periods by this: 0 for computed times, jitter for measured ones.
  std::chrono::nanoseconds jitter{0};
  std::function<OpenedCamera()> open;  ///< a new, closed camera
};

inline void PrintTo(const CameraCase& camera_case, std::ostream* os) { *os << camera_case.name; }

inline std::string camera_case_name(const testing::TestParamInfo<CameraCase>& tested) { return tested.param.name; }

/// The suite for every backend.
class CameraConformance : public testing::TestWithParam<CameraCase> {
 protected:
  void SetUp() override { reopen(); }

  void reopen() { opened_ = GetParam().open(); }
  void start(const CameraSettings& settings);
  void start() { start(GetParam().settings); }

  /// Gets the next frame: in real time a grab waits until it is due, in lock-step it advances the camera's time.
  Result<Frame> next();

  Camera& camera() { return *opened_.camera; }

  OpenedCamera opened_;
  CameraSettings applied_;
};

/// The suite for backends whose frames are lost if they are not grabbed: `pass` must be given.
class CameraThatDoesNotWait : public CameraConformance {};

/// The suite for backends in lock-step: a grab advances the camera's time to the next frame.
class CameraInLockStep : public CameraConformance {};

}  // namespace twocone::test
