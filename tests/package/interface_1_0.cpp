// SPDX-License-Identifier: Apache-2.0
// Uses every name of the interface of version 1.0. It must compile against every 1.x as it is: nothing here is changed
// when the interface grows (docs/compatibility.md). It runs without a robot.
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <twocone/localisation.h>
#include <twocone/twocone.h>

namespace {

using twocone::FailureCode;
using twocone::FixVerdict;
using twocone::RangeVerdict;

constexpr std::array kFailures{FailureCode::kNotFound,  FailureCode::kUnavailable,  FailureCode::kInvalidState,
                               FailureCode::kTimeout,   FailureCode::kDisconnected, FailureCode::kBadData,
                               FailureCode::kCancelled, FailureCode::kRefused};
constexpr std::array kFixes{FixVerdict::kOk,   FixVerdict::kGap,           FixVerdict::kAmbiguous,  FixVerdict::kTooFew,
                            FixVerdict::kWeak, FixVerdict::kContradictory, FixVerdict::kOutOfBounds};
constexpr std::array kRanges{
    RangeVerdict::kOk,          RangeVerdict::kNotSeen,       RangeVerdict::kTruncated,    RangeVerdict::kNoMatch,
    RangeVerdict::kBeyondLimit, RangeVerdict::kSameColour,    RangeVerdict::kOneView,      RangeVerdict::kOccluded,
    RangeVerdict::kSaturated,   RangeVerdict::kTwoCandidates, RangeVerdict::kInconsistent, RangeVerdict::kImpossible};

static_assert(!std::is_copy_constructible_v<twocone::ConnectedRobot> &&
              std::is_nothrow_move_constructible_v<twocone::ConnectedRobot> &&
              std::is_nothrow_move_assignable_v<twocone::ConnectedRobot>);
static_assert(std::is_copy_constructible_v<twocone::CapturedFrame>);
static_assert(std::is_nothrow_move_constructible_v<twocone::Localiser>);

/// Never called: what it does needs a robot.
int drive(const std::filesystem::path& file) {
  const twocone::OpenOptions options{.seed = 3, .stop_on_signals = true, .is_cancelled = [] { return false; }};
  twocone::Expected<twocone::ConnectedRobot> robot = twocone::open_robot(file, options);
  if (!robot) return std::puts(robot.error().message.c_str());
  twocone::ConnectedRobot own = std::move(*twocone::open_robot(file));
  const twocone::RobotDescription& description = robot->description();
  for (const twocone::RobotDescription::Landmark& l : description.landmarks()) {
    std::printf("%s %g %g %g %g\n", l.name.c_str(), l.x_m, l.y_m, l.radius_m, l.top_m);
  }
  const std::vector<twocone::Pose> waypoints = description.waypoints();
  const twocone::Pose start = description.start();
  twocone::Localiser localiser(description);
  const twocone::Expected<twocone::CapturedFrame> frame = robot->next_frame(std::chrono::milliseconds(1000));
  const twocone::Expected<twocone::ImageView> lower = frame->lower(), upper = frame->upper();
  const std::uint8_t first = lower->rgb[std::size_t(lower->width_px) * std::size_t(upper->height_px) - 1];
  const twocone::Expected<twocone::FrameReport> report = localiser.update(*frame);
  for (const twocone::RangeAnswer& range : report->ranges) {
    std::printf("%s %s %g %g %g %g\n", range.landmark.c_str(), twocone::to_string(range.verdict),
                range.range_m.value_or(0), range.sigma_range_m.value_or(0), range.bearing_rad.value_or(0),
                range.sigma_bearing_rad.value_or(0));
  }
  const twocone::PoseAnswer& fix = report->fix;
  const std::optional<twocone::PoseCovariance> covariances[] = {fix.covariance, report->covariance};
  const std::optional<twocone::Pose> poses[] = {fix.pose, report->track, report->odometry, robot->true_pose()};
  twocone::OwnFrame images;
  images.lower = *lower;
  images.upper = *upper;
  images.t_s = frame->t_s();
  images.wheels = twocone::WheelTurns{.left_rad = 0.1, .right_rad = 0.2};
  const bool is_answered = bool(localiser.update(images));
  const twocone::Expected<twocone::Velocity> applied = own.set_velocity({.forward_mps = 0.1, .turn_radps = 0.2});
  const std::string contact = robot->contact();
  robot->stop();
  return int(first) + int(waypoints.size()) + int(start.x_m + applied->forward_mps) + int(frame->number()) +
         int(is_answered) + int(contact.size()) + int(std::size(covariances)) + int(std::size(poses));
}

}  // namespace

int main() {
  std::size_t letters = 0;
  for (const FailureCode code : kFailures) letters += std::string(twocone::to_string(code)).size();
  for (const FixVerdict verdict : kFixes) letters += std::string(twocone::to_string(verdict)).size();
  for (const RangeVerdict verdict : kRanges) letters += std::string(twocone::to_string(verdict)).size();
  const std::vector<twocone::LandmarkObservation> seen{
      {.x_m = 3, .y_m = 0, .range_m = 3, .bearing_rad = 0, .sigma_range_m = 0.01, .sigma_bearing_rad = 0.01},
      {.x_m = 0, .y_m = 4, .range_m = 4, .bearing_rad = 1.5707963, .sigma_range_m = 0.01, .sigma_bearing_rad = 0.01}};
  const twocone::PoseAnswer answer = twocone::locate(seen);
  const twocone::Failure failure{FailureCode::kTimeout, "text"};
  const twocone::Expected<int> none = failure;
  try {
    static_cast<void>(*none);
  } catch (const std::logic_error& error) {
    if (error.what() != failure.message) return 1;
  }
  try {
    return drive("/nonexistent/robot.yaml");
  } catch (const std::runtime_error&) {
    return letters > 100 && answer.pose && answer.covariance && std::puts("interface 1.0") >= 0 ? 0 : 1;
  }
}
