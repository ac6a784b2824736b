// SPDX-License-Identifier: Apache-2.0
#include "hal/robot.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "base/errors.h"

namespace twocone {
namespace {

// A camera that delivers nothing for this many periods, and for at least this time, has failed.
constexpr double kSilentPeriods = 4;
constexpr std::chrono::milliseconds kLeastSilence{1'000};

void check(const std::vector<NamedCamera>& others) {
  base::Complaints bad;
  std::set<std::string> taken{"lower", "upper"};
  for (std::size_t i = 0; i < others.size(); ++i) {
    const std::string& name = others[i].name;
    if (!others[i].camera) bad.add("camera {} ('{}') is missing", i, name);
    if (name.empty()) bad.add("camera {} has no name", i);
    if (!taken.insert(name).second) bad.add("the name '{}' of camera {} is taken", name, i);
  }
  bad.raise("Robot");
}

}  // namespace

Robot::Robot(StereoRig cameras, std::unique_ptr<DiffDrive> drive, std::unique_ptr<GroundTruth> truth,
             std::vector<NamedCamera> others, RobotPace pace)
    : cameras_(std::move(cameras)),
      drive_(std::move(drive)),
      truth_(std::move(truth)),
      others_(std::move(others)),
      pace_(std::move(pace)) {
  if (!drive_) throw std::invalid_argument("Robot: needs a drive");
  check(others_);
}

Robot::~Robot() { stop(); }

RobotPace Robot::pace() const {
  RobotPace pace = pace_;
  if (pace.frame_timeout.count() != 0) return pace;
  const double rate_hz = std::min(cameras_.lower().facts().settings.rate_hz, cameras_.upper().facts().settings.rate_hz);
  pace.frame_timeout =
      std::max(kLeastSilence, std::chrono::milliseconds(std::llround(1000 * kSilentPeriods / rate_hz)));
  return pace;
}

Status Robot::start(const CameraSettings& lower, const CameraSettings& upper) {
  if (auto started = cameras_.start(lower, upper); !started) return started;
  for (const NamedCamera& other : others_) {
    auto started = start_camera(other.name, *other.camera, other.settings);
    if (started) continue;
    stop_cameras();
    return started;
  }
  return {};
}

Result<StereoFrame> Robot::next_frame(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + std::min(timeout, kLongestWait);
  if (!waiting_pair_) {
    auto pair = cameras_.grab(timeout);
    if (!pair) return pair.error();
    waiting_pair_.emplace(std::move(*pair));
  }
  while (waiting_others_.size() < others_.size()) {
    const NamedCamera& other = others_[waiting_others_.size()];
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    auto frame = other.camera->grab(std::max(left, std::chrono::milliseconds(0)));
    if (!frame) return with_name(other.name, frame.error());
    waiting_others_.push_back({other.name, std::move(*frame)});
  }
  StereoFrame pair = std::move(*waiting_pair_);
  waiting_pair_.reset();
  other_frames_ = std::exchange(waiting_others_, {});
  return pair;
}

std::optional<Pose2> Robot::true_pose() const {
  if (!truth_) return std::nullopt;
  return truth_->true_pose();
}

std::string Robot::contact() const { return truth_ ? truth_->contact() : std::string(); }

void Robot::stop() noexcept {
  // There is no caller to report the error to. If the drive did not get the command, the dead-man rule stops it.
  if (drive_) (void)drive_->stop();
  stop_cameras();
}

void Robot::stop_cameras() noexcept {
  cameras_.stop();
  for (const NamedCamera& other : others_) {
    if (other.camera) other.camera->stop();
  }
  waiting_pair_.reset();
  waiting_others_.clear();
}

}  // namespace twocone
