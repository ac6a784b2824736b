// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/wheel_bench.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twocone::doctor {
namespace {

using std::numbers::pi;

constexpr double kTurnAroundSpeed_radps = 2 * pi;
constexpr double kBenchSpeedShare = 0.3;
constexpr double kStillCounts = 2.5;  // two counts, and rounding
constexpr double kStill_rad = 0.01;   // if the drive does not report its counts
constexpr double kStep_s = 0.02;
constexpr double kWatchStep_s = 0.005;
constexpr double kWaitStep_s = 0.05;
constexpr double kStillFor_s = 0.3;
constexpr double kStopTime_s = 2;
constexpr int kWheelTroublesInARow = 3;
// A wheel that turns this far against its command, or beyond the angle that it may reach, is out of control.
constexpr double kOutOfHand_rad = pi;
constexpr double kOutOfHandFactor = 2;

}  // namespace

double still_rad(double counts_per_turn) {
  return counts_per_turn > 0 ? kStillCounts * 2 * pi / counts_per_turn : kStill_rad;
}

WheelBench::WheelBench(DiffDrive& drive, double counts_per_turn, const Surroundings& surroundings)
    : drive_(drive),
      surroundings_(surroundings),
      speed_radps_(std::min(kTurnAroundSpeed_radps, kBenchSpeedShare * drive.limits().max_speed_radps)),
      still_rad_(doctor::still_rad(counts_per_turn)) {}

Result<WheelSample> WheelBench::read() {
  const auto angles = drive_.read_angles();
  if (!angles) return angles.error();
  const Timestamp now = surroundings_.clock.now();
  return WheelSample{angles->time.clock == now.clock ? angles->time.seconds() : now.seconds(), angles->left_rad,
                     angles->right_rad};
}

void WheelBench::wait(double seconds) {
  double left_s = seconds;
  while (left_s > 0) {
    end_if_asked(surroundings_);
    surroundings_.sleep(nanoseconds_of(std::min(left_s, kWaitStep_s)));
    left_s -= kWaitStep_s;
  }
}

bool WheelBench::is_out_of_hand(const Course& course, const WheelSpeeds& speeds) const {
  const WheelSample& first = course.samples.front();
  const WheelSample& now = course.samples.back();
  const double time_s = now.t_s - first.t_s;
  const auto is_off = [&](double turned_rad, double speed_radps) {
    const double forward_rad = speed_radps < 0 ? -turned_rad : turned_rad;
    const double most_rad = kOutOfHandFactor * std::max(std::abs(speed_radps), speed_radps_) * time_s + kOutOfHand_rad;
    return forward_rad < -kOutOfHand_rad || forward_rad > most_rad;
  };
  return is_off(now.left_rad - first.left_rad, speeds.left_radps) ||
         is_off(now.right_rad - first.right_rad, speeds.right_radps);
}

Course WheelBench::drive(const WheelSpeeds& speeds, double seconds, const std::string& what,
                         const std::function<bool(const WheelSample&)>& is_far_enough) {
  Course course;
  const double begin_s = surroundings_.now_s();
  int troubles = 0;
  while (surroundings_.now_s() - begin_s < seconds && !course.error) {
    end_if_asked(surroundings_);
    surroundings_.progress(what, (surroundings_.now_s() - begin_s) / seconds);
    course.last_command_s = surroundings_.now_s();
    const auto set = drive_.set_speeds(speeds);
    const auto sample = read();
    if (set && sample) {
      troubles = 0;
      course.samples.push_back(*sample);
      if (is_out_of_hand(course, speeds)) {
        course.ran_away = true;
        break;
      }
      if (is_far_enough && is_far_enough(*sample)) break;
    } else {
      const Error& error = set ? sample.error() : set.error();
      const bool may_pass = error.code == ErrorCode::kTimeout || error.code == ErrorCode::kBadData;
      if (!may_pass || ++troubles >= kWheelTroublesInARow) course.error = error;
    }
    surroundings_.sleep(nanoseconds_of(kStep_s));
  }
  if (course.ran_away || course.error) halt();
  return course;
}

Course WheelBench::watch(double seconds) {
  Course course;
  const double begin_s = surroundings_.now_s();
  double moved_s = begin_s;
  int troubles = 0;
  while (surroundings_.now_s() - begin_s < seconds) {
    end_if_asked(surroundings_);
    const auto sample = read();
    if (!sample) {
      if (++troubles >= kWheelTroublesInARow) {
        course.error = sample.error();
        break;
      }
    } else {
      troubles = 0;
      if (!course.samples.empty()) {
        const WheelSample& before = course.samples.back();
        if (before.left_rad != sample->left_rad || before.right_rad != sample->right_rad) moved_s = sample->t_s;
      }
      course.samples.push_back(*sample);
      if (surroundings_.now_s() - moved_s > kStillFor_s) break;
    }
    surroundings_.sleep(nanoseconds_of(kWatchStep_s));
  }
  return course;
}

void WheelBench::halt() {
  static_cast<void>(drive_.stop());
  static_cast<void>(watch(kStopTime_s));
}

}  // namespace twocone::doctor
