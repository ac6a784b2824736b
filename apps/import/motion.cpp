// SPDX-License-Identifier: Apache-2.0
#include "apps/import/motion.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include <fmt/format.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::importer {
namespace {

constexpr Stamp kRounding{500'000};
constexpr int kHolePeriods = 5;
constexpr Stamp kLeastHole = std::chrono::seconds(1);

std::vector<runlog::PoseRow> read_trajectory(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw config::FileError("{}: no such file", file.string());
  std::vector<runlog::PoseRow> poses = runlog::read_poses(file);
  for (const runlog::PoseRow& pose : poses) {
    if (!std::isfinite(pose.x_m) || !std::isfinite(pose.y_m) || !std::isfinite(pose.heading_rad)) {
      throw config::FileError("{}: the pose at {} s has a number that is not finite", file.string(), pose.t_s);
    }
  }
  return poses;
}

/// Returns the times to the nanosecond. A double of seconds since 1970 is not that exact.
std::vector<Stamp> times_in(const std::filesystem::path& file) {
  std::vector<Stamp> times;
  for (const Line& line : read_lines(file)) {
    if (!line.whole) break;
    const std::string first = line.text.substr(0, line.text.find(' '));
    const auto time = parse_seconds(first);
    if (!time) config::refuse_line(file, line.number, "the time is '{}', must be seconds", first);
    times.push_back(*time);
  }
  return times;
}

/// Returns the columns with these names, or nothing if one is missing.
std::optional<std::vector<std::size_t>> columns(const std::vector<std::string>& header,
                                                std::initializer_list<const char*> names) {
  std::vector<std::size_t> places;
  for (const char* name : names) {
    const auto found = std::ranges::find(header, name);
    if (found == header.end()) return std::nullopt;
    places.push_back(std::size_t(found - header.begin()));
  }
  return places;
}

}  // namespace

Timeline::Timeline(std::vector<Stamp> times, const std::string& name) : times_(std::move(times)) {
  if (times_.size() < 2) throw config::FileError("{}: has {} times, must have 2 or more", name, times_.size());
  for (std::size_t i = 1; i < times_.size(); ++i) {
    if (times_[i] <= times_[i - 1]) {
      throw config::FileError("{}: the time {:.9f} s stands after {:.9f} s, times must rise", name,
                              to_seconds(times_[i]), to_seconds(times_[i - 1]));
    }
  }
  widest_ = std::max(kLeastHole, kHolePeriods * *median_period(times_));
}

std::optional<Timeline::Place> Timeline::find(Stamp time) const {
  if (time < times_.front() - kRounding || time > times_.back() + kRounding) return std::nullopt;
  time = std::clamp(time, times_.front(), times_.back());
  const auto next = std::min(std::upper_bound(times_.begin(), times_.end(), time), times_.end() - 1);
  const std::size_t before = std::size_t(next - times_.begin()) - 1;
  const Stamp apart = times_[before + 1] - times_[before];
  const double share = to_seconds(time - times_[before]) / to_seconds(apart);
  if (apart > widest_ && share > 0 && share < 1) return std::nullopt;
  return Place{before, share};
}

Trajectory::Trajectory(const std::filesystem::path& file)
    : poses_(read_trajectory(file)), timeline_(times_in(file), file.string()) {}

std::optional<runlog::PoseRow> Trajectory::at(Stamp time) const {
  const auto place = timeline_.find(time);
  if (!place) return std::nullopt;
  const runlog::PoseRow& from = poses_[place->before];
  const runlog::PoseRow& to = poses_[place->before + 1];
  const double turn_rad = localisation::wrap_angle_rad(to.heading_rad - from.heading_rad);
  return runlog::PoseRow{0, std::lerp(from.x_m, to.x_m, place->share), std::lerp(from.y_m, to.y_m, place->share),
                         localisation::wrap_angle_rad(from.heading_rad + place->share * turn_rad)};
}

WheelsOfPoses wheels_of(const std::vector<localisation::Pose>& poses, const localisation::WheelGeometry& wheels) {
  WheelsOfPoses result;
  if (poses.empty()) return result;
  result.turns.emplace_back();
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const localisation::Pose& from = poses[i - 1];
    const localisation::Pose& to = poses[i];
    const double turn_rad = localisation::wrap_angle_rad(to.heading_rad - from.heading_rad);
    const double course_rad = from.heading_rad + turn_rad / 2;
    const double dx_m = to.x_m - from.x_m;
    const double dy_m = to.y_m - from.y_m;
    const double arc_m = (dx_m * std::cos(course_rad) + dy_m * std::sin(course_rad)) / localisation::sinc(turn_rad / 2);
    result.path_m += std::abs(arc_m);
    result.sideways_m += std::abs(dy_m * std::cos(course_rad) - dx_m * std::sin(course_rad));
    const localisation::WheelTurns& last = result.turns.back();
    const auto turned = localisation::wheel_turns(wheels, arc_m, turn_rad);
    result.turns.push_back({last.left_rad + turned.left_rad, last.right_rad + turned.right_rad});
  }
  return result;
}

WheelFile::WheelFile(const std::filesystem::path& file, const localisation::WheelGeometry& wheels) {
  const std::vector<Line> lines = read_lines(file);
  if (lines.empty()) config::refuse_line(file, 1, "is empty, must begin with a header line of columns");
  const std::vector<std::string> header = runlog::split_fields(lines[0].text);
  const auto angles = columns(header, {"t_s", "left_rad", "right_rad"});
  const auto places = angles ? angles : columns(header, {"t_s", "x_m", "y_m", "heading_rad"});
  if (!places) {
    config::refuse_line(file, lines[0].number,
                        "the header is '{}', must have t_s,left_rad,right_rad or t_s,x_m,y_m,heading_rad",
                        lines[0].text);
  }
  std::vector<Stamp> times;
  std::vector<localisation::Pose> poses;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const bool is_cut = i + 1 == lines.size() && !lines[i].whole;
    const auto fields = runlog::split_fields(lines[i].text);
    if (fields.size() != header.size()) {
      if (is_cut) break;
      config::refuse_line(file, lines[i].number, "has {} fields, must have {}", fields.size(), header.size());
    }
    const std::string& t_s = fields[places->front()];
    const auto time = parse_seconds(t_s);
    if (!time) config::refuse_line(file, lines[i].number, "t_s is '{}', must be seconds", t_s);
    if (!times.empty() && *time <= times.back()) {
      config::refuse_line(file, lines[i].number, "t_s is {}, must be later than in the row before it", t_s);
    }
    std::vector<double> values;
    for (std::size_t k = 1; k < places->size(); ++k) {
      const std::size_t column = (*places)[k];
      if (!runlog::parse_field(fields[column], values.emplace_back()) || !std::isfinite(values.back())) {
        config::refuse_line(file, lines[i].number, "{} is '{}', must be a number", header[column], fields[column]);
      }
    }
    times.push_back(*time);
    if (angles) {
      turns_.push_back({values[0], values[1]});
    } else {
      poses.push_back({values[0], values[1], values[2]});
    }
  }
  timeline_.emplace(std::move(times), file.string());
  if (angles) return;
  WheelsOfPoses found = wheels_of(poses, wheels);
  turns_ = std::move(found.turns);
  events_.push_back(fmt::format(
      "{} contains poses: the wheel angles are computed from them with the robot file's wheels", file.string()));
  constexpr double kWorthSaying = 0.01;
  if (found.sideways_m > kWorthSaying * found.path_m) {
    events_.push_back(
        fmt::format("{} goes {:.3f} m sideways on a path of {:.3f} m, which wheels cannot: is heading_rad "
                    "in radians, counter-clockwise from the x axis?",
                    file.string(), found.sideways_m, found.path_m));
  }
}

std::optional<localisation::WheelTurns> WheelFile::at(Stamp time) const {
  const auto place = timeline_->find(time);
  if (!place) return std::nullopt;
  const localisation::WheelTurns& from = turns_[place->before];
  const localisation::WheelTurns& to = turns_[place->before + 1];
  return localisation::WheelTurns{std::lerp(from.left_rad, to.left_rad, place->share),
                                  std::lerp(from.right_rad, to.right_rad, place->share)};
}

}  // namespace twocone::importer
