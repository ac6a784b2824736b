// SPDX-License-Identifier: Apache-2.0
#include "twocone/twocone.h"

#include <csignal>

#include <algorithm>
#include <atomic>
#include <utility>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "apps/interface/convert.h"
#include "apps/runs/loop/frame_taker.h"
#include "drivers/backends.h"

namespace twocone {
namespace interface {
namespace {

// The signal handler sets it. It is never cleared, because a program that receives such a signal must end.
std::atomic<bool> signalled{false};
static_assert(std::atomic<bool>::is_always_lock_free);
const std::atomic<bool> kNever{false};

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { signalled = true; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

Failure to_failure(const Error& error) {
  static_assert(int(FailureCode::kNotFound) == int(ErrorCode::kNotFound) &&
                int(FailureCode::kCancelled) == int(ErrorCode::kCancelled) &&
                int(FailureCode::kRefused) == int(ErrorCode::kRefused));
  return {FailureCode(int(error.code)), error.message};
}

RangeAnswer range_answer(const std::string& landmark, const vision::RangeMeasurement& m) {
  static_assert(int(RangeVerdict::kOk) == int(vision::RangeVerdict::kOk) &&
                int(RangeVerdict::kOneView) == int(vision::RangeVerdict::kOneView) &&
                int(RangeVerdict::kImpossible) == int(vision::RangeVerdict::kImpossible));
  return {landmark, RangeVerdict(int(m.verdict)), m.range_m, m.sigma_range_m, m.bearing_rad, m.sigma_bearing_rad};
}

Pose to_pose(const localisation::Pose& pose) { return {pose.x_m, pose.y_m, pose.heading_rad}; }

}  // namespace
}  // namespace interface

inline namespace v0_1 {

// ---- description

struct RobotDescription::Impl {
  config::Robot robot;
  config::Map map;
};

RobotDescription::RobotDescription(const std::filesystem::path& robot_file) {
  config::Robot robot = config::read_robot(robot_file);
  config::Map map = config::read_map(robot.map);
  impl_ = std::make_shared<Impl>(Impl{std::move(robot), std::move(map)});
}

std::vector<RobotDescription::Landmark> RobotDescription::landmarks() const {
  std::vector<Landmark> landmarks;
  for (const config::Landmark& l : impl_->map.landmarks)
    landmarks.push_back({l.name, l.x_m, l.y_m, l.radius_m, l.top_m});
  return landmarks;
}

std::vector<Pose> RobotDescription::waypoints() const {
  std::vector<Pose> waypoints;
  for (const config::Point& p : impl_->robot.waypoints) waypoints.push_back({p.x_m, p.y_m, 0});
  return waypoints;
}

Pose RobotDescription::start() const { return interface::to_pose(config::to_start_pose(impl_->robot)); }

// ---- frame

struct CapturedFrame::Impl {
  std::uint64_t number = 0;
  runs::TakenPair pair;
  const std::atomic<bool>* stop = nullptr;
  // The images that lower() and upper() have returned.
  mutable std::optional<Image> lower, upper;

  static Expected<ImageView> view(const Frame& of, const std::atomic<bool>& stop, std::optional<Image>& kept) {
    if (!kept) {
      const auto image = runs::wait_for_image(of, stop);
      if (!image) return interface::to_failure(image.error());
      auto rgb = to_rgb8(**image);
      if (!rgb) return interface::to_failure(rgb.error());
      kept = *std::move(rgb);
    }
    return ImageView{kept->width_px, kept->height_px, {kept->bytes.data(), kept->bytes.size()}};
  }
};

std::uint64_t CapturedFrame::number() const { return impl_->number; }
double CapturedFrame::t_s() const { return impl_->pair.t_s; }
Expected<ImageView> CapturedFrame::lower() const {
  return Impl::view(impl_->pair.frame.lower, *impl_->stop, impl_->lower);
}
Expected<ImageView> CapturedFrame::upper() const {
  return Impl::view(impl_->pair.frame.upper, *impl_->stop, impl_->upper);
}

// ---- robot

struct ConnectedRobot::Impl {
  RobotDescription description;
  localisation::WheelGeometry wheels;
  Robot robot;
  runs::PairTaker pairs;
  const std::atomic<bool>* stop = &interface::kNever;
  std::uint64_t frames = 0;

  /// Stops the wheels and converts the error. If the command does not arrive, the dead-man rule stops them.
  Failure fail(const Error& error) {
    static_cast<void>(robot.drive().stop());
    return interface::to_failure(error);
  }
};

ConnectedRobot::ConnectedRobot(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ConnectedRobot::ConnectedRobot(ConnectedRobot&&) noexcept = default;
ConnectedRobot& ConnectedRobot::operator=(ConnectedRobot&&) noexcept = default;
ConnectedRobot::~ConnectedRobot() = default;

const RobotDescription& ConnectedRobot::description() const { return impl_->description; }

Expected<CapturedFrame> ConnectedRobot::next_frame(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    auto frame = impl_->robot.next_frame(std::clamp(left, std::chrono::milliseconds(0), runs::kStopSlice));
    if (*impl_->stop) return impl_->fail({ErrorCode::kCancelled, "interrupted by a signal"});
    if (!frame) {
      if (frame.error().code == ErrorCode::kTimeout && std::chrono::steady_clock::now() < deadline) continue;
      return impl_->fail(frame.error());
    }
    auto pair = impl_->pairs.take(impl_->robot, *std::move(frame));
    if (!pair) return impl_->fail(pair.error());
    CapturedFrame result;
    result.impl_ = std::make_shared<CapturedFrame::Impl>(
        CapturedFrame::Impl{impl_->frames++, *std::move(pair), impl_->stop, {}, {}});
    return result;
  }
}

Expected<Velocity> ConnectedRobot::set_velocity(const Velocity& velocity) {
  const localisation::WheelGeometry& wheels = impl_->wheels;
  const auto turns = localisation::wheel_turns(wheels, velocity.forward_mps, velocity.turn_radps);
  const auto applied = impl_->robot.drive().set_speeds({turns.left_rad, turns.right_rad});
  if (!applied) return interface::to_failure(with_name("drive", applied.error()));
  return Velocity{wheels.radius_m * (applied->left_radps + applied->right_radps) / 2,
                  wheels.radius_m * (applied->right_radps - applied->left_radps) / wheels.separation_m};
}

std::optional<Pose> ConnectedRobot::true_pose() const {
  const auto truth = impl_->robot.true_pose();
  return truth ? std::optional(interface::to_pose(*truth)) : std::nullopt;
}

void ConnectedRobot::stop() noexcept { impl_->robot.stop(); }

Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file, const OpenOptions& options) {
  RobotDescription description(robot_file);
  const config::Robot& robot = description.impl_->robot;
  if (options.stop_on_signals) interface::stop_on_signals();
  const auto settings = config::to_robot_settings(robot, description.impl_->map, options.seed);
  auto opened = drivers::open_robot(settings);
  if (!opened) return interface::to_failure(opened.error());
  if (auto started = opened->start(settings.lower.settings, settings.upper.settings); !started) {
    return interface::to_failure(started.error());
  }
  const auto wheels = config::to_wheels(robot);
  auto impl = std::make_unique<ConnectedRobot::Impl>(ConnectedRobot::Impl{
      description, wheels, *std::move(opened), runs::PairTaker(wheels, config::to_start_pose(robot)),
      options.stop_on_signals ? &interface::signalled : &interface::kNever});
  return ConnectedRobot(std::move(impl));
}

Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file) { return open_robot(robot_file, {}); }

// ---- localiser

struct Localiser::Impl {
  RobotDescription description;
  estimation::Estimator estimator;
  estimation::Track track;
};

Localiser::Localiser(const RobotDescription& description) {
  const config::Robot& robot = description.impl_->robot;
  const auto method = estimation::method_of(robot);
  impl_ = std::make_unique<Impl>(Impl{description, estimation::Estimator(method, robot, description.impl_->map),
                                      estimation::Track(method, robot, description.impl_->map)});
}
Localiser::Localiser(Localiser&&) noexcept = default;
Localiser& Localiser::operator=(Localiser&&) noexcept = default;
Localiser::~Localiser() = default;

Expected<FrameReport> Localiser::update(const CapturedFrame& frame) {
  const runs::TakenPair& taken = frame.impl_->pair;
  const auto images = runs::wait_for_images(taken.frame, *frame.impl_->stop);
  if (!images) return interface::to_failure(images.error());
  const auto answer = impl_->estimator.answer(*images->first, *images->second);
  if (!answer) return interface::to_failure(answer.error());
  const auto track = impl_->track.follow(taken.t_s, taken.angles.left_rad, taken.angles.right_rad,
                                         taken.odometry.heading_rad, answer->fix, answer->scan);
  FrameReport report;
  const auto& landmarks = impl_->description.impl_->map.landmarks;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    report.ranges.push_back(interface::range_answer(landmarks[i].name, answer->ranges[i]));
  }
  report.fix = interface::to_answer(answer->fix);
  if (track.position_m && track.heading_rad) {
    report.track = Pose{track.position_m->x(), track.position_m->y(), *track.heading_rad};
    if (track.covariance) report.covariance = interface::to_array(*track.covariance);
  }
  report.odometry = interface::to_pose(taken.odometry);
  return report;
}

// ---- names. Each points into a string literal.

const char* to_string(FixVerdict verdict) { return to_string(localisation::FixVerdict(int(verdict))).data(); }
const char* to_string(RangeVerdict verdict) { return to_string(vision::RangeVerdict(int(verdict))).data(); }
const char* to_string(FailureCode code) { return to_string(ErrorCode(int(code))).data(); }

}  // namespace v0_1
}  // namespace twocone
