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

#include "drivers/sim_povray/hall.h"

namespace twocone::sim_povray {

/// What a robot's picture of an instant looks like: every byte depends on robot, view, instant and place.
inline Image fake_picture(const std::string& robot, std::uint32_t view, std::uint64_t tick,
                          const CameraSettings& size) {
  Image image;
  image.width_px = size.width_px;
  image.height_px = size.height_px;
  image.format = view == 1 ? PixelFormat::kGrey8 : PixelFormat::kRgb8;
  image.bytes.resize(*picture_bytes(image.format, size.width_px, size.height_px));
  std::uint64_t state = tick * 977 + view * 31 + (robot.empty() ? 0 : std::uint64_t(robot.back()));
  for (auto& byte : image.bytes) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    byte = std::uint8_t(state >> 56);
  }
  return image;
}

/// A world in memory that keeps the lock-step and draws fake_picture(). The robots `1`, `2` and `3` are in it. Its
/// pictures are finished by a thread of its own, the newest first, so that they come out of order.
class FakeHall final : public Hall {
 public:
  FakeHall() : painter_([this] { paint(); }) {}
  ~FakeHall() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    painter_.join();
  }

  Result<std::unique_ptr<Seat>> take_seat(const SeatSettings& settings) override;
  [[nodiscard]] std::string rendering() const override { return "in memory"; }

  /// From now on no picture gets finished.
  void hold_pictures() { holding_ = true; }
  /// From now on every picture fails.
  void fail_pictures() { failing_ = true; }
  /// From now on pictures are one pixel too wide.
  void stretch_pictures() { stretching_ = true; }

  struct Robot {
    SeatSettings settings;
    std::vector<ViewSettings> views;
    WheelSpeeds speeds;
    bool asks = false;
  };
  /// What is known of a robot that has a seat.
  Robot robot(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = robots_.find(name);
    return found == robots_.end() ? Robot{} : found->second;
  }
  std::size_t seats() {
    const std::lock_guard lock(mutex_);
    return robots_.size();
  }

 private:
  friend class FakeSeat;
  struct Waiting {
    std::promise<ImageResult> promise;
    ImageResult result;
  };

  void paint() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
      changed_.wait_for(lock, std::chrono::milliseconds(1));
      if (holding_ || canvas_.empty()) continue;
      Waiting newest = std::move(canvas_.back());
      canvas_.pop_back();
      newest.promise.set_value(std::move(newest.result));
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Robot> robots_;
  std::uint64_t tick_ = 0;
  std::deque<Waiting> canvas_;
  std::atomic<bool> holding_{false};
  std::atomic<bool> failing_{false};
  std::atomic<bool> stretching_{false};
  bool stopping_ = false;
  std::thread painter_;
};

class FakeSeat final : public Seat {
 public:
  FakeSeat(FakeHall& hall, std::string name) : hall_(hall), name_(std::move(name)) { read_state(); }
  ~FakeSeat() override {
    const std::lock_guard lock(hall_.mutex_);
    hall_.robots_.erase(name_);
    if (hall_.robots_.empty()) hall_.tick_ = 0;
    step_if_all_ask();
  }

  [[nodiscard]] const SeatState& state() const override { return state_; }

  Result<ViewId> open_view(const ViewSettings& view) override {
    const std::lock_guard lock(hall_.mutex_);
    if (view.camera_name != "lower" && view.camera_name != "upper") {
      return Error{ErrorCode::kRefused, "no camera '" + view.camera_name + "'"};
    }
    auto& views = hall_.robots_[name_].views;
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
    std::unique_lock lock(hall_.mutex_);
    const std::uint64_t before = hall_.tick_;
    hall_.robots_[name_].asks = true;
    step_if_all_ask();
    hall_.changed_.wait_until(lock, deadline, [&] { return hall_.tick_ != before; });
    if (hall_.tick_ == before) {
      hall_.robots_[name_].asks = false;
      return Error{ErrorCode::kTimeout, "somebody has not asked"};
    }
    read_state();
    return {};
  }

  std::shared_future<ImageResult> picture(ViewId view) override {
    const std::lock_guard lock(hall_.mutex_);
    Image image = fake_picture(name_, view, hall_.tick_, sizes_.at(view));
    if (hall_.stretching_) image.width_px += 1;
    ImageResult result = std::make_shared<const Image>(std::move(image));
    if (hall_.failing_) result = Error{ErrorCode::kBadData, "FILE:3: POV-Ray: no such texture"};
    hall_.canvas_.push_back({{}, std::move(result)});
    return hall_.canvas_.back().promise.get_future().share();
  }

  Status command(const WheelSpeeds& speeds) override {
    const std::lock_guard lock(hall_.mutex_);
    hall_.robots_[name_].speeds = speeds;
    return {};
  }
  Status halt() noexcept override { return command({}); }

  [[nodiscard]] bool is_waited_for() const override {
    const std::lock_guard lock(hall_.mutex_);
    return !hall_.robots_[name_].asks &&
           std::any_of(hall_.robots_.begin(), hall_.robots_.end(), [](const auto& entry) { return entry.second.asks; });
  }

 private:
  // With hall_.mutex_ held.
  void step_if_all_ask() {
    auto& robots = hall_.robots_;
    if (robots.empty() || !std::all_of(robots.begin(), robots.end(), [](auto& r) { return r.second.asks; })) return;
    ++hall_.tick_;
    for (auto& [name, robot] : robots) robot.asks = false;
    hall_.changed_.notify_all();
  }
  void read_state() {
    state_.tick = hall_.tick_;
    state_.now = std::chrono::nanoseconds(hall_.tick_ * 66'666'667);
    state_.pose = {0.25 * double(hall_.tick_), -1.5, 0.7};
    state_.left_rad = 0.1 * double(hall_.tick_);
    state_.right_rad = 0.3 * double(hall_.tick_);
    state_.contact = hall_.tick_ % 2 == 1 ? "landmark red" : "";
  }

  FakeHall& hall_;
  const std::string name_;
  SeatState state_;
  std::vector<CameraSettings> sizes_;
};

inline Result<std::unique_ptr<Seat>> FakeHall::take_seat(const SeatSettings& settings) {
  const std::lock_guard lock(mutex_);
  if (settings.name != "1" && settings.name != "2" && settings.name != "3") {
    return Error{ErrorCode::kRefused, "the scene has no robot." + settings.name};
  }
  if (robots_.count(settings.name) != 0) return Error{ErrorCode::kRefused, "robot." + settings.name + " is taken"};
  robots_[settings.name].settings = settings;
  return std::unique_ptr<Seat>(std::make_unique<FakeSeat>(*this, settings.name));
}

}  // namespace twocone::sim_povray
