// SPDX-License-Identifier: Apache-2.0
#include "apps/import/stamps.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <map>
#include <tuple>

#include <boost/algorithm/string.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/tables/tables.h"
#include "base/quantile.h"

namespace twocone::importer {
namespace {

constexpr std::size_t kDigitsSince1970_ns = 19;  // from 2001 to 2262

bool are_digits(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

/// Returns how many decimals of the unit are whole nanoseconds.
std::optional<std::size_t> decimals(StampUnit unit, bool has_point, std::size_t digits) {
  for (const NamedUnit& named : kNamedUnits) {
    if (named.unit == unit) return named.decimals;
  }
  if (has_point) return 9;
  return digits == kDigitsSince1970_ns ? std::optional<std::size_t>(0) : std::nullopt;
}

}  // namespace

std::optional<Stamp> parse_stamp(std::string_view text, StampUnit unit) {
  const std::size_t point = text.find('.');
  const bool has_point = point != std::string_view::npos;
  const std::string_view whole = text.substr(0, point);
  const std::string_view fraction = has_point ? text.substr(point + 1) : std::string_view();
  if (whole.empty() || !are_digits(whole) || !are_digits(fraction)) return std::nullopt;
  const auto kept = decimals(unit, has_point, whole.size());
  if (!kept) return std::nullopt;
  std::string digits(whole);
  digits += fraction.substr(0, *kept);
  digits.append(*kept - std::min(*kept, fraction.size()), '0');
  std::int64_t count = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return Stamp(count);
}

std::string stamp_forms(StampUnit unit) {
  if (unit != StampUnit::kAuto) return "a number >= 0 of digits and at most one decimal point";
  return "seconds with a decimal point, or nanoseconds of 19 digits; for other stamps give --times-in s, ms, us or ns";
}

std::optional<Stamp> parse_seconds(const std::string& text) {
  const bool negative = !text.empty() && text[0] == '-';
  if (const auto stamp = parse_stamp(std::string_view(text).substr(negative ? 1 : 0), StampUnit::kSeconds)) {
    return negative ? -*stamp : *stamp;
  }
  constexpr double kMost_s = 9e9;  // nanoseconds of 63 bits
  double seconds = 0;
  if (!runlog::parse_field(text, seconds) || !(std::abs(seconds) < kMost_s)) return std::nullopt;
  return Stamp(std::llround(seconds * 1e9));
}

double to_seconds(Stamp stamp) { return std::chrono::duration<double>(stamp).count(); }

std::vector<Line> read_lines(const std::filesystem::path& file) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  const std::string text = config::read_text(file);
  std::vector<Line> lines;
  std::size_t number = 0;
  for (std::size_t begin = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string line = boost::trim_copy_if(text.substr(begin, end - begin), boost::is_any_of(" \t\r"));
    begin = end + 1;
    ++number;
    if (!line.empty() && line[0] != '#') lines.push_back({number, std::move(line), end < text.size()});
  }
  return lines;
}

std::optional<Stamp> median_period(const std::vector<Stamp>& times) {
  if (times.size() < 2) return std::nullopt;
  std::vector<Stamp> periods;
  for (std::size_t i = 1; i < times.size(); ++i) periods.push_back(times[i] - times[i - 1]);
  return base::median(std::move(periods));
}

std::vector<Pair> pair_images(const std::vector<Stamp>& lower, const std::vector<Stamp>& upper, Stamp max_skew) {
  std::vector<std::tuple<Stamp, std::size_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < lower.size(); ++i) {
    const auto first = std::lower_bound(upper.begin(), upper.end(), lower[i] - max_skew);
    for (auto u = first; u != upper.end() && *u <= lower[i] + max_skew; ++u) {
      candidates.emplace_back(std::chrono::abs(*u - lower[i]), i, std::size_t(u - upper.begin()));
    }
  }
  std::ranges::sort(candidates);
  std::map<std::size_t, std::size_t> chosen;
  for (const auto& [skew, l, u] : candidates) {
    const auto next = chosen.lower_bound(l);
    const bool after = next == chosen.end() || (next->first != l && next->second > u);
    const bool before = next == chosen.begin() || std::prev(next)->second < u;
    if (after && before) chosen.emplace_hint(next, l, u);
  }
  std::vector<Pair> pairs;
  pairs.reserve(chosen.size());
  for (const auto& [l, u] : chosen) pairs.push_back({l, u});
  return pairs;
}

std::vector<std::uint64_t> lost_before(const std::vector<Stamp>& times, const std::vector<std::size_t>& used) {
  const auto period = median_period(times);
  // Number of exposures, stored or not, up to and including each image.
  std::vector<std::uint64_t> exposures(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::uint64_t step = 1;
    if (i > 0) {
      const double periods = to_seconds(times[i] - times[i - 1]) / to_seconds(*period);
      step = std::uint64_t(std::max(1LL, std::llround(periods)));
    }
    exposures[i] = (i > 0 ? exposures[i - 1] : 0) + step;
  }
  std::vector<std::uint64_t> lost;
  for (std::size_t i = 0; i < used.size(); ++i) {
    lost.push_back(exposures[used[i]] - (i > 0 ? exposures[used[i - 1]] : 0) - 1);
  }
  return lost;
}

}  // namespace twocone::importer
