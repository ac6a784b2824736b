// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/wording.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

namespace twocone::tradeoff {

std::string antialias_name(int antialias) { return antialias > 1 ? fmt::format("+R{}", antialias) : "-"; }

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  if (value == 0) return "0";
  constexpr int kMostDecimals = 6;
  const int magnitude = int(std::floor(std::log10(std::abs(value))));
  return fmt::format("{:.{}f}", value, std::clamp(digits - 1 - magnitude, 0, kMostDecimals));
}

std::string fitting(double value, std::size_t width) {
  std::string text;
  for (int digits = 3; digits > 0; --digits) {
    text = significant(value, digits);
    if (text.size() <= width) return text;
  }
  constexpr std::size_t kPoint = 2;  // columns of "0."
  text = std::abs(value) < 1 && width > kPoint ? fmt::format("{:.{}f}", value, width - kPoint)
                                               : fmt::format("{:.0e}", value);
  return text.size() <= width ? text : std::string(width, '*');
}

std::optional<std::size_t> baseline_of(const Sweep& sweep) {
  const Images own = sweep.as_is ? sweep.settings.at(*sweep.as_is).setting.images : Images{};
  // The robot's own images are best, then its own size, then the most accurate setting.
  const auto rank = [&](const SettingResult& result) {
    const Images& images = result.setting.images;
    const bool same_size = images.width_px == own.width_px && images.height_px == own.height_px;
    return std::tuple(images != own, !same_size, result.setting.frames, result.position_m->mean.value);
  };
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    const SettingResult& result = sweep.settings[i];
    if (result.setting.level != Level::kPaper || !result.position_m) continue;
    if (!best || rank(result) < rank(sweep.settings[*best])) best = i;
  }
  return best;
}

std::optional<Span> span_of(const Sweep& sweep) {
  std::vector<double> errors_m, times_s;
  for (const SettingResult& result : sweep.settings) {
    if (!result.on_simulation_frontier || !result.position_m) continue;
    errors_m.push_back(result.position_m->mean.value);
    times_s.push_back(result.simulation_time_s().value);
  }
  if (errors_m.empty()) return std::nullopt;
  const auto [least_m, most_m] = std::ranges::minmax(errors_m);
  const auto [least_s, most_s] = std::ranges::minmax(times_s);
  return Span{int(errors_m.size()), least_m, most_m, least_s, most_s};
}

std::vector<std::string> rule_sentences() {
  return {
      fmt::format("Rule: a setting is on a frontier if it answers at least {:.0f} % of its frames and no other such "
                  "setting is at least as accurate, at least as cheap, and better in one of the two.",
                  kLeastAnswered * 100),
      "Truth: the simulator's own pose, exact to 1e-9 m. Every frame with an answer counts.",
      "Intervals: 95 %, over episodes, which are drives from independent random poses. Frames of one episode are not "
      "independent of each other."};
}

std::vector<std::string> growth_sentences(const Sweep& sweep) {
  std::vector<std::string> sentences;
  for (const Growth& g : growth(sweep)) {
    sentences.push_back(fmt::format("{} by {}: exponent {:.2f} ({:.2f} to {:.2f}, {} points)", g.of,
                                    g.axis == Axis::kSize ? "pixels of an image" : facts_of(g.axis).name, g.exponent,
                                    g.low, g.high, g.points));
  }
  return sentences;
}

}  // namespace twocone::tradeoff
