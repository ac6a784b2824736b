// SPDX-License-Identifier: Apache-2.0
#include "twocone/twocone.h"

#include <csignal>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <fmt/format.h>

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

inline namespace v1_0 {

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
  runs::IsStopped is_stopped;
  // The images that lower() and upper() have returned.
  mutable std::shared_ptr<const Image> lower, upper;

  static Expected<ImageView> view(const Frame& of, const runs::IsStopped& is_stopped,
                                  std::shared_ptr<const Image>& kept) {
    if (!kept) {
      auto image = runs::wait_for_image(of, is_stopped);
      if (!image) return interface::to_failure(image.error());
      if ((*image)->format != PixelFormat::kRgb8) {
        auto rgb = to_rgb8(**image);
        if (!rgb) return interface::to_failure(rgb.error());
        *image = std::make_shared<const Image>(*std::move(rgb));
      }
      kept = *std::move(image);
    }
    return ImageView{kept->width_px, kept->height_px, {kept->bytes.data(), kept->bytes.size()}};
  }
};

std::uint64_t CapturedFrame::number() const { return impl_->number; }
double CapturedFrame::t_s() const { return impl_->pair.t_s; }
Expected<ImageView> CapturedFrame::lower() const {
  return Impl::view(impl_->pair.frame.lower, impl_->is_stopped, impl_->lower);
}
Expected<ImageView> CapturedFrame::upper() const {
  return Impl::view(impl_->pair.frame.upper, impl_->is_stopped, impl_->upper);
}

// ---- robot

struct ConnectedRobot::Impl {
  RobotDescription description;
  localisation::WheelGeometry wheels;
  Robot robot;
  runs::PairTaker pairs;
  runs::IsStopped is_stopped;
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
    if (impl_->is_stopped()) return impl_->fail({ErrorCode::kCancelled, "interrupted while a frame was awaited"});
    if (!frame) {
      if (frame.error().code == ErrorCode::kTimeout && std::chrono::steady_clock::now() < deadline) continue;
      return impl_->fail(frame.error());
    }
    auto pair = impl_->pairs.take(impl_->robot, *std::move(frame));
    if (!pair) return impl_->fail(pair.error());
    CapturedFrame result;
    result.impl_ = std::make_shared<CapturedFrame::Impl>(
        CapturedFrame::Impl{impl_->frames++, *std::move(pair), impl_->is_stopped, {}, {}});
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

std::string ConnectedRobot::contact() const { return impl_->robot.contact(); }

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
      [on_signals = options.stop_on_signals, is_cancelled = options.is_cancelled] {
        return (on_signals && interface::signalled) || (is_cancelled && is_cancelled());
      }});
  return ConnectedRobot(std::move(impl));
}

Expected<ConnectedRobot> open_robot(const std::filesystem::path& robot_file) { return open_robot(robot_file, {}); }

// ---- localiser

struct Localiser::Impl {
  RobotDescription description;
  estimation::Estimator estimator;
  estimation::Track track;
  localisation::Odometry odometry;
  // Of the last frame of update(OwnFrame).
  std::optional<double> last_t_s{};
  bool had_wheels = false;

  /// Computes the answer of a frame. @param wheels of the frame; nothing: they are not known
  Expected<FrameReport> answer(const Image& lower, const Image& upper, double t_s,
                               const std::optional<WheelTurns>& wheels, const localisation::Pose& odometry_pose) {
    const auto answer = estimator.answer(lower, upper);
    if (!answer) return interface::to_failure(answer.error());
    const auto track_answer = wheels ? track.follow(t_s, wheels->left_rad, wheels->right_rad, odometry_pose.heading_rad,
                                                    answer->fix, answer->scan)
                                     : estimation::track_without_wheels(answer->fix);
    FrameReport report;
    const auto& landmarks = description.impl_->map.landmarks;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      report.ranges.push_back(interface::range_answer(landmarks[i].name, answer->ranges[i]));
    }
    report.fix = interface::to_answer(answer->fix);
    if (track_answer.position_m && track_answer.heading_rad) {
      report.track = Pose{track_answer.position_m->x(), track_answer.position_m->y(), *track_answer.heading_rad};
      if (track_answer.covariance) report.covariance = interface::to_array(*track_answer.covariance);
    }
    report.odometry = interface::to_pose(odometry_pose);
    return report;
  }
};

Localiser::Localiser(const RobotDescription& description) {
  const config::Robot& robot = description.impl_->robot;
  const auto method = estimation::method_of(robot);
  impl_ = std::make_unique<Impl>(Impl{description, estimation::Estimator(method, robot, description.impl_->map),
                                      estimation::Track(method, robot, description.impl_->map),
                                      localisation::Odometry(config::to_wheels(robot), config::to_start_pose(robot))});
}
Localiser::Localiser(Localiser&&) noexcept = default;
Localiser& Localiser::operator=(Localiser&&) noexcept = default;
Localiser::~Localiser() = default;

Expected<FrameReport> Localiser::update(const CapturedFrame& frame) {
  const runs::TakenPair& taken = frame.impl_->pair;
  const auto images = runs::wait_for_images(taken.frame, frame.impl_->is_stopped);
  if (!images) return interface::to_failure(images.error());
  return impl_->answer(*images->first, *images->second, taken.t_s,
                       WheelTurns{taken.angles.left_rad, taken.angles.right_rad}, taken.odometry);
}

Expected<FrameReport> Localiser::update(const OwnFrame& frame) {
  const bool has_wheels = frame.wheels.has_value();
  const bool is_finite =
      std::isfinite(frame.t_s) &&
      (!has_wheels || (std::isfinite(frame.wheels->left_rad) && std::isfinite(frame.wheels->right_rad)));
  if (!is_finite) return Failure{FailureCode::kBadData, "the frame's time and wheel angles must be finite"};
  for (const ImageView* const view : {&frame.lower, &frame.upper}) {
    const auto size = image_bytes(PixelFormat::kRgb8, view->width_px, view->height_px);
    if (size != view->rgb.size()) {
      return Failure{FailureCode::kBadData,
                     fmt::format("an image of {} x {} pixels has {} bytes, must have 3 for a pixel", view->width_px,
                                 view->height_px, view->rgb.size())};
    }
  }
  if (impl_->last_t_s && !(frame.t_s > *impl_->last_t_s)) {
    return Failure{FailureCode::kInvalidState, fmt::format("the frame's time is {} s, must be later than {} s, that of "
                                                           "the frame before",
                                                           frame.t_s, *impl_->last_t_s)};
  }
  if (impl_->last_t_s && has_wheels != impl_->had_wheels) {
    return Failure{FailureCode::kInvalidState, "all frames of a localiser must have wheel angles, or none"};
  }
  // The pixels are the caller's. Nobody keeps them beyond this call.
  const auto image = [](const ImageView& view) {
    return Image{view.width_px, view.height_px, PixelFormat::kRgb8,
                 Bytes::lent(view.rgb, std::make_shared<const char>())};
  };
  const auto odometry = has_wheels ? impl_->odometry.update(frame.wheels->left_rad, frame.wheels->right_rad)
                                   : config::to_start_pose(impl_->description.impl_->robot);
  auto answer = impl_->answer(image(frame.lower), image(frame.upper), frame.t_s, frame.wheels, odometry);
  if (!answer) return answer;
  impl_->last_t_s = frame.t_s;
  impl_->had_wheels = has_wheels;
  return answer;
}

// ---- names. Each points into a string literal.

const char* to_string(FixVerdict verdict) { return to_string(localisation::FixVerdict(int(verdict))).data(); }
const char* to_string(RangeVerdict verdict) { return to_string(vision::RangeVerdict(int(verdict))).data(); }
const char* to_string(FailureCode code) { return to_string(ErrorCode(int(code))).data(); }

}  // namespace v1_0
}  // namespace twocone
