// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/quantile.h"

namespace twocone::doctor {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr const char* kPairPart = "pair";
constexpr milliseconds kPairTime{2'000};
constexpr double kPoorShare = 0.5;
constexpr double kFewUnpaired = 0.05;
// Free-running cameras have any skew. A skew within this fraction of a period shows that the cameras are synchronised.
constexpr double kTogether = 0.05;
// The nearest partner of a frame is at most half a period away. The rest allows for the scatter of capture times.
constexpr double kAnyPartner = 0.55;
constexpr double kMargin = 1.5;

double period_s(const PairUnderTest& test) { return 1 / test.lower.rate_hz; }

Pairs take_pairs(StereoRig& rig, const PairUnderTest& test, double seconds, const Surroundings& surroundings) {
  FrameWait wait(seconds, test.lower.rate_hz, kPairTime, surroundings);
  Pairs pairs;
  double last_s = 0;
  std::uint64_t unpaired_before = 0;
  while (wait.goes_on()) {
    const auto pair = rig.grab(wait.patience());
    if (!pair) {
      if (wait.outlasts(pair.error())) continue;
      pairs.ended_by = pair.error();
      break;
    }
    const double now_s = pair->lower.header().captured.seconds();
    if (wait.came(now_s)) {
      pairs.skews_s.push_back(seconds_of(pair->skew()));
      pairs.intervals_s.push_back(now_s - last_s);
    } else {
      unpaired_before = rig.unpaired();
    }
    last_s = now_s;
    surroundings.progress("pair", wait.done_s() / seconds);
  }
  pairs.unpaired = rig.unpaired() - unpaired_before;
  return pairs;
}

/// Opens, starts and stops the pair, and takes frames in between.
Result<Pairs> try_pair(const PairUnderTest& test, nanoseconds max_skew, const OpenPair& open, double seconds,
                       const Surroundings& surroundings) {
  auto rig = open(max_skew);
  if (!rig) return rig.error();
  if (const auto started = rig->start(test.lower, test.upper); !started) return started.error();
  const Stopping stopping(*rig);
  return take_pairs(*rig, test, seconds, surroundings);
}

double unpaired_share(const Pairs& pairs) {
  const double frames = 2 * double(pairs.skews_s.size()) + double(pairs.unpaired);
  return frames > 0 ? double(pairs.unpaired) / frames : 1;
}

/// Returns the key of a robot file, in whole tenths of a millisecond.
std::string as_key(double seconds) { return fmt::format("max_skew_s: {:g}", std::ceil(1e4 * seconds - 1e-6) / 1e4); }

}  // namespace

std::vector<Row> judge_pairs(const Pairs& pairs, const PairUnderTest& test) {
  const double limit_ms = 1e3 * seconds_of(test.max_skew);
  if (pairs.intervals_s.empty()) {
    return {{kPairPart, "pairs", fmt::format("no two frames within {:g} ms", limit_ms), kFailed, "see skew"}};
  }
  double time_s = 0;
  for (const double interval_s : pairs.intervals_s) time_s += interval_s;
  const double rate_hz = time_s > 0 ? double(pairs.intervals_s.size()) / time_s : 0;
  Row rate{kPairPart, "pairs", fmt::format("{:.2f} per second of {:g}", rate_hz, test.lower.rate_hz)};
  if (rate_hz < (1 - kRateShare) * test.lower.rate_hz) {
    rate.judge(rate_hz < kPoorShare * test.lower.rate_hz ? kFailed : kWarning,
               "see skew; for two cameras on one bus: format: MJPG, or another port for one");
  }

  const double share = unpaired_share(pairs);
  Row unpaired{kPairPart, "unpaired",
               fmt::format("{} frames without a partner, {:.1f} %", pairs.unpaired, 100 * share)};
  if (share > kFewUnpaired) {
    unpaired.judge(share > kPoorShare ? kFailed : kWarning, "see skew");
  }

  const double longest_s = std::ranges::max(pairs.intervals_s);
  const double timeout_s = seconds_of(test.command_timeout);
  Row wait{kPairPart, "longest wait",
           fmt::format("{:.0f} ms; the wheels stop after {:.0f} ms", 1e3 * longest_s, 1e3 * timeout_s)};
  if (std::max(longest_s, period_s(test)) >= timeout_s) {
    wait.judge(kWarning, "the wheels stop between frames: set a higher rate_hz, or a longer command_timeout_s");
  }
  return {rate, unpaired, wait};
}

Row judge_skew(const Pairs& any, const PairUnderTest& test) {
  const double limit_s = seconds_of(test.max_skew);
  if (any.skews_s.empty()) {
    return {kPairPart, "skew", "no pairs at all", kFailed, "check that both rates are equal; see the cameras' rows"};
  }
  double most_s = 0;
  for (const double skew_s : any.skews_s) most_s = std::max(most_s, std::abs(skew_s));
  Row row{kPairPart, "skew",
          fmt::format("median {:.1f} ms, at most {:.1f} ms; limit {:g} ms", 1e3 * base::quantile(any.skews_s, 0.5),
                      1e3 * most_s, 1e3 * limit_s)};
  const double free_s = StereoRig::kFreeSkew * period_s(test);
  if (most_s <= kTogether * period_s(test)) {
    if (most_s > limit_s) {
      row.judge(kFailed, as_key(kMargin * most_s));
    }
  } else if (limit_s < free_s) {
    row.judge(
        most_s > limit_s ? kFailed : kWarning,
        fmt::format("{} (0.6 of a period): free-running cameras may have a skew of up to half a period at each start",
                    as_key(free_s)));
  }
  return row;
}

void check_pair(const PairUnderTest& test, const OpenPair& open, double seconds, const Surroundings& surroundings,
                Report& report) {
  const auto failed = [&](const Error& error) {
    report.add(
        failed_row(kPairPart, "stream", error, camera_advice(error.code) + "; check whether both are on one bus"));
  };
  auto pairs = try_pair(test, test.max_skew, open, seconds, surroundings);
  if (!pairs) return failed(pairs.error());
  const bool went_away = pairs->ended_by && pairs->ended_by->code != ErrorCode::kTimeout;
  if (went_away) failed(*pairs->ended_by);
  for (Row& row : judge_pairs(*pairs, test)) report.add(std::move(row));
  if (went_away) return;
  if (unpaired_share(*pairs) <= kFewUnpaired) return report.add(judge_skew(*pairs, test));
  const nanoseconds any = nanoseconds_of(kAnyPartner * period_s(test));
  auto wide = try_pair(test, std::max(any, test.max_skew), open, seconds, surroundings);
  if (!wide) return failed(wide.error());
  report.add(judge_skew(*wide, test));
}

}  // namespace twocone::doctor
