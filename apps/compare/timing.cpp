// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/side.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/config/to_layers.h"
#include "base/quantile.h"

namespace twocone::compare {
namespace {

double log_choose(double n, double k) { return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1); }

/// Returns the probability of all whole numbers from `least` to `most` that are at most as probable as `seen`.
template <typename LogProbability>
double tail_of(double seen, double least, double most, const LogProbability& log_probability) {
  constexpr double kRounding = 1e-9;  // of logarithms of some thousands
  const double limit = log_probability(seen) + kRounding;
  double sum = 0;
  for (double k = least; k <= most; ++k) {  // NOLINT(clang-analyzer-security.FloatLoopCounter): whole numbers
    const double here = log_probability(k);
    if (here <= limit) sum += std::exp(here);
  }
  return std::min(1.0, sum);
}

}  // namespace

Timing timing_of(const runlog::RunData& run) {
  Timing timing;
  std::vector<double> steps_s;
  double skew = 0, squares = 0;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const runlog::FrameRow& frame = run.frames[i];
    skew += frame.upper_t_s - frame.lower_t_s;
    squares += std::pow(frame.upper_t_s - frame.lower_t_s, 2);
    timing.most_skew_s = std::max(timing.most_skew_s, std::abs(frame.skew_s));
    timing.lost[0] += frame.lower_lost;
    timing.lost[1] += frame.upper_lost;
    if (i == 0) continue;
    const runlog::FrameRow& last = run.frames[i - 1];
    if (frame.lower_sequence == last.lower_sequence + 1 && frame.upper_sequence == last.upper_sequence + 1) {
      steps_s.push_back(frame.t_s - last.t_s);
    }
  }
  const auto count = double(run.frames.size());
  for (const std::size_t k : {0, 1}) timing.all[k] = run.frames.size() + timing.lost[k];
  timing.skew_s = skew / count;
  timing.skew_sigma_s = std::sqrt(std::max(0.0, squares / count - timing.skew_s * timing.skew_s) / count);
  if (!steps_s.empty()) {
    const double usual_s = base::quantile(steps_s, 0.5);
    if (usual_s > 0) timing.rate_hz = 1 / usual_s;
    double sum = 0;
    for (const double step_s : steps_s) sum += (step_s - usual_s) * (step_s - usual_s);
    timing.jitter_s = std::sqrt(sum / double(steps_s.size()));
  }
  if (!config::is_simulated(run.robot) && run.frames.size() > 1) {
    const runlog::FrameRow& first = run.frames.front();
    const runlog::FrameRow& last = run.frames.back();
    if (first.host_t_s && last.host_t_s) timing.ageing_s = (*last.host_t_s - last.t_s) - (*first.host_t_s - first.t_s);
  }
  return timing;
}

double lost_p_value(std::uint64_t lost, std::uint64_t all, double probability) {
  if (probability <= 0) return lost == 0 ? 1 : 0;
  if (probability >= 1) return lost == all ? 1 : 0;
  return tail_of(double(lost), 0, double(all), [&](double k) {
    return log_choose(double(all), k) + k * std::log(probability) + (double(all) - k) * std::log1p(-probability);
  });
}

double lost_p_value(std::uint64_t lost_a, std::uint64_t all_a, std::uint64_t lost_b, std::uint64_t all_b) {
  const auto lost = double(lost_a + lost_b);
  const auto all = double(all_a + all_b);
  return tail_of(double(lost_a), std::max(0.0, lost - double(all_b)), std::min(lost, double(all_a)), [&](double of_a) {
    return log_choose(double(all_a), of_a) + log_choose(double(all_b), lost - of_a) - log_choose(all, lost);
  });
}

}  // namespace twocone::compare
