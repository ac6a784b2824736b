// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::sim_povray {

/// Returns a robot's image of a step. Every byte depends on the robot, the view, the step and its position.
inline Image fake_image(const std::string& robot, std::uint32_t view, std::uint64_t step, const CameraSettings& size) {
  Image image{size.width_px, size.height_px, view == 1 ? PixelFormat::kGrey8 : PixelFormat::kRgb8, {}};
  image.bytes.resize(*image_bytes(image.format, size.width_px, size.height_px));
  std::uint64_t state = step * 977 + view * 31 + (robot.empty() ? 0 : std::uint64_t(robot.back()));
  for (auto& byte : image.bytes) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    byte = std::uint8_t(state >> 56);
  }
  return image;
}

/// A world in memory that keeps the lock-step and renders fake_image(). It contains the robots `1`, `2` and `3`. A
/// separate thread finishes the images, the newest first, so that they arrive out of order.
class FakeHost final : public SimulationHost {
 public:
  FakeHost() : finisher_([this] { finish_images(); }) {}
  ~FakeHost() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    finisher_.join();
  }

  Result<std::unique_ptr<RobotSession>> join(const SessionSettings& settings) override;
  Status reset() override { return {}; }
  [[nodiscard]] std::string rendering() const override { return "in memory"; }

  /// From now on no image is finished.
  void hold_images() { holding_ = true; }
  /// From now on every image fails.
  void fail_images() { failing_ = true; }
  /// From now on images are one pixel too wide.
  void stretch_images() { stretching_ = true; }

  struct Robot {
    SessionSettings settings;
    std::vector<ViewSettings> views;
    WheelSpeeds speeds;
    bool asks = false;
  };
  /// Returns the settings and the state of a robot that has a session.
  Robot robot(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = robots_.find(name);
    return found == robots_.end() ? Robot{} : found->second;
  }
  std::size_t sessions() {
    const std::lock_guard lock(mutex_);
    return robots_.size();
  }

 private:
  friend class FakeSession;
  struct PendingImage {
    std::promise<ImageResult> promise;
    ImageResult result;
  };

  void finish_images() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
      changed_.wait_for(lock, std::chrono::milliseconds(1));
      if (holding_ || pending_.empty()) continue;
      PendingImage newest = std::move(pending_.back());
      pending_.pop_back();
      newest.promise.set_value(std::move(newest.result));
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Robot> robots_;
  std::uint64_t step_ = 0;
  std::deque<PendingImage> pending_;
  std::atomic<bool> holding_{false};
  std::atomic<bool> failing_{false};
  std::atomic<bool> stretching_{false};
  bool stopping_ = false;
  std::thread finisher_;
};

class FakeSession final : public RobotSession {
 public:
  FakeSession(FakeHost& host, std::string name) : host_(host), name_(std::move(name)) { read_state(); }
  ~FakeSession() override {
    const std::lock_guard lock(host_.mutex_);
    host_.robots_.erase(name_);
    if (host_.robots_.empty()) host_.step_ = 0;
    step_if_all_ask();
  }

  [[nodiscard]] const SessionState& state() const override { return state_; }

  Result<ViewId> open_view(const ViewSettings& view) override {
    const std::lock_guard lock(host_.mutex_);
    if (view.camera_name != "lower" && view.camera_name != "upper") {
      return Error{ErrorCode::kRefused, "no camera '" + view.camera_name + "'"};
    }
    auto& views = host_.robots_[name_].views;
    views.push_back(view);
    sizes_.emplace_back();
    return ViewId(views.size() - 1);
  }

  Status configure_view(ViewId view, const CameraSettings& settings) override {
    if (settings.rate_hz != 15) return Error{ErrorCode::kRefused, "this world runs at 15 Hz"};
    sizes_.at(view) = settings;
    return {};
  }

  void release_view(ViewId /*view*/) noexcept override {}

  Status step(SteadyTime deadline) override {
    std::unique_lock lock(host_.mutex_);
    const std::uint64_t before = host_.step_;
    host_.robots_[name_].asks = true;
    step_if_all_ask();
    host_.changed_.wait_until(lock, deadline, [&] { return host_.step_ != before; });
    if (host_.step_ == before) {
      host_.robots_[name_].asks = false;
      return Error{ErrorCode::kTimeout, "another robot has not asked"};
    }
    read_state();
    return {};
  }

  std::shared_future<ImageResult> image(ViewId view) override {
    const std::lock_guard lock(host_.mutex_);
    Image image = fake_image(name_, view, host_.step_, sizes_.at(view));
    if (host_.stretching_) image.width_px += 1;
    ImageResult result = std::make_shared<const Image>(std::move(image));
    if (host_.failing_) result = Error{ErrorCode::kBadData, "FILE:3: POV-Ray: no such texture"};
    host_.pending_.push_back({{}, std::move(result)});
    return host_.pending_.back().promise.get_future().share();
  }

  Status command(const WheelSpeeds& speeds) override {
    const std::lock_guard lock(host_.mutex_);
    host_.robots_[name_].speeds = speeds;
    return {};
  }
  Status halt() noexcept override { return command({}); }

  [[nodiscard]] bool is_waited_for() const override {
    const std::lock_guard lock(host_.mutex_);
    return !host_.robots_[name_].asks &&
           std::any_of(host_.robots_.begin(), host_.robots_.end(), [](const auto& entry) { return entry.second.asks; });
  }

 private:
  // With host_.mutex_ held.
  void step_if_all_ask() {
    auto& robots = host_.robots_;
    if (robots.empty() || !std::all_of(robots.begin(), robots.end(), [](auto& r) { return r.second.asks; })) return;
    ++host_.step_;
    for (auto& [name, robot] : robots) robot.asks = false;
    host_.changed_.notify_all();
  }
  void read_state() {
    state_.step = host_.step_;
    state_.now = std::chrono::nanoseconds(host_.step_ * 66'666'667);
    state_.pose = {0.25 * double(host_.step_), -1.5, 0.7};
    state_.left_rad = 0.1 * double(host_.step_);
    state_.right_rad = 0.3 * double(host_.step_);
    state_.contact = host_.step_ % 2 == 1 ? "landmark red" : "";
  }

  FakeHost& host_;
  const std::string name_;
  SessionState state_;
  std::vector<CameraSettings> sizes_;
};

inline Result<std::unique_ptr<RobotSession>> FakeHost::join(const SessionSettings& settings) {
  const std::lock_guard lock(mutex_);
  if (settings.name != "1" && settings.name != "2" && settings.name != "3") {
    return Error{ErrorCode::kRefused, "the scene has no robot." + settings.name};
  }
  if (robots_.count(settings.name) != 0) return Error{ErrorCode::kRefused, "robot." + settings.name + " is taken"};
  robots_[settings.name].settings = settings;
  return std::unique_ptr<RobotSession>(std::make_unique<FakeSession>(*this, settings.name));
}

}  // namespace twocone::sim_povray
