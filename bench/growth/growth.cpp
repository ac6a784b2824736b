// SPDX-License-Identifier: Apache-2.0
#include "bench/growth/growth.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "bench/growth/power_law.h"

namespace twocone::bench {
namespace {

std::string cell(const std::vector<double>& repeats, int digits) {
  if (repeats.empty()) return "";
  const auto [least, most] = std::minmax_element(repeats.begin(), repeats.end());
  return fmt::format("{:.{}f} ({:.{}f} to {:.{}f})", median(repeats), digits, *least, digits, *most, digits);
}

std::string exponent(const std::vector<double>& sizes, const Column& column) {
  if (!column.grows) return "";
  std::vector<double> medians;
  for (const auto& repeats : column.repeats) medians.push_back(median(repeats));
  const PowerLaw law = fit_power_law(sizes, medians);
  return fmt::format("**{:.2f}** ({:.2f} to {:.2f})", law.exponent, law.low, law.high);
}

std::string last_exponent(const std::vector<double>& sizes, const Column& column) {
  if (!column.grows) return "";
  const std::size_t last = sizes.size() - 1;
  return fmt::format("{:.2f}", std::log(median(column.repeats.at(last)) / median(column.repeats.at(last - 1))) /
                                   std::log(sizes.at(last) / sizes.at(last - 1)));
}

}  // namespace

std::string markdown(const Growth& growth) {
  std::string text = fmt::format("### {}\n\n{}\n\n| {} |", growth.title, growth.what, growth.size_name);
  for (const Column& column : growth.columns) text += fmt::format(" {} |", column.name);
  text += "\n|--:|";
  for (std::size_t i = 0; i < growth.columns.size(); ++i) text += "--:|";
  for (std::size_t i = 0; i < growth.sizes.size(); ++i) {
    text += fmt::format("\n| {} |", growth.labels.at(i));
    for (const Column& column : growth.columns) text += fmt::format(" {} |", cell(column.repeats.at(i), column.digits));
  }
  text += "\n| exponent |";
  for (const Column& column : growth.columns) text += fmt::format(" {} |", exponent(growth.sizes, column));
  text += "\n| between the last two |";
  for (const Column& column : growth.columns) text += fmt::format(" {} |", last_exponent(growth.sizes, column));
  return text + "\n";
}

std::string standing_at(const Pose2& pose) {
  return fmt::format("rotate {}*y translate W({}, {}, 0)\n", -pose.heading_rad * 180 / std::numbers::pi, pose.x_m,
                     pose.y_m);
}

std::string robot_at(const Pose2& pose, const std::string& first_line) {
  return fmt::format(
      "union {{\n  {}\n  object {{ Robot_Body }}\n  object {{ Robot_Cone(0.06, 90) translate Robot_Up(0.37) }}\n  "
      "object {{ Robot_Cone(0.06, 90) translate Robot_Up(0.67) }}\n  object {{ Robot_Mast(0.78) }}\n  {}}}\n",
      first_line, standing_at(pose));
}

std::vector<std::unique_ptr<Camera>> start_pair(sim_povray::Simulation& simulation, const CameraSettings& settings,
                                                int antialias) {
  std::vector<std::unique_ptr<Camera>> cameras;
  for (const char* name : {"lower", "upper"}) {
    cameras.push_back(value(simulation.open_camera({name, antialias, {}})));
    (void)value(cameras.back()->configure(settings));
    value(cameras.back()->start());
  }
  return cameras;
}

int ranged(const std::vector<vision::RangeMeasurement>& measurements) {
  return int(
      std::count_if(measurements.begin(), measurements.end(), [](const auto& m) { return m.range_m.has_value(); }));
}

double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double thread_cpu_s() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

double median(std::vector<double> values) {
  if (values.empty()) throw std::invalid_argument("no values to take the median of");
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

}  // namespace twocone::bench
