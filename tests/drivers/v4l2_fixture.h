// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/v4l2_camera/v4l2_camera.h"
#include "tests/drivers/scripted_kernel.h"

namespace twocone::test {

/// The timeout for a frame that is already available; only a test that fails waits this long.
constexpr std::chrono::milliseconds kPlenty{30'000};

/// A camera on a scripted kernel. The test fails if the camera leaves a file open or memory mapped.
class V4l2Test : public testing::Test {
 protected:
  void TearDown() override {
    camera_.reset();
    EXPECT_EQ(kernel_->files_held(), 0U) << "left open";
    EXPECT_EQ(kernel_->mappings(), 0U) << "left mapped";
    EXPECT_EQ(kernel_->streaming(), 0U) << "left streaming";
  }

  Status open(const v4l2::V4l2Settings& settings = {"/dev/video0", "", {}}) {
    auto opened = v4l2::open_camera(settings, kernel_);
    if (!opened) return opened.error();
    camera_ = *std::move(opened);
    return {};
  }

  /// Opens the camera if necessary, configures and starts it.
  void start(const CameraSettings& settings = {64, 48, 20}) {
    if (!camera_) {
      const auto opened = open();
      ASSERT_TRUE(opened) << opened.error().message;
    }
    const auto configured = camera_->configure(settings);
    ASSERT_TRUE(configured) << configured.error().message;
    const auto started = camera_->start();
    ASSERT_TRUE(started) << started.error().message;
  }

  /// Returns the error of a call that must fail.
  template <typename T>
  static Error error_of(const Result<T>& result) {
    if (!result) return result.error();
    ADD_FAILURE() << "it worked";
    return {ErrorCode::kNotFound, ""};
  }

  std::shared_ptr<ScriptedKernel> kernel_ = std::make_shared<ScriptedKernel>();
  ScriptedDevice& device_ = kernel_->add({});
  std::unique_ptr<Camera> camera_;
};

}  // namespace twocone::test
