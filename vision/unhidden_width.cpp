// SPDX-License-Identifier: Apache-2.0
#include "vision/unhidden_width.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace twocone::vision {
namespace {

// Widths within this share of each other are counted as equal.
constexpr double kStep = 0.005;
// Steps in the window of widths that agree.
const int kWindow = int(2 * std::log1p(UnhiddenWidth::kSame) / kStep);
// Many are this share of the most that agree anywhere.
constexpr double kMany = 0.4;
// A width is too narrow if it is so by all three together: its noise, its error from blur and the brightness beside it,
// and kSame.
constexpr double kNarrowSigmas = 3;
constexpr double kNarrow_px = 0.2;

bool is_judged(const OutlineWidth& width) {
  return width.seen_px >= UnhiddenWidth::kLeast_px && width.expected_px > 0 && std::isfinite(width.seen_px);
}

}  // namespace

void UnhiddenWidth::add(const OutlineWidth& width, double radius_m) {
  if (!is_judged(width)) return;
  ++count_;
  ++counts_[int(std::round(std::log(width.seen_px / width.expected_px * radius_m) / kStep))];
}

double UnhiddenWidth::radius_m() const {
  struct Window {
    int first;
    std::size_t count;
  };
  std::vector<Window> windows;
  std::size_t most = 0;
  for (auto first = counts_.begin(); first != counts_.end(); ++first) {
    std::size_t count = 0;
    for (auto i = first; i != counts_.end() && i->first <= first->first + kWindow; ++i) count += i->second;
    windows.push_back({first->first, count});
    most = std::max(most, count);
  }
  for (std::size_t last = windows.size(); last-- > 0;) {
    if (double(windows[last].count) < kMany * double(most)) continue;
    // The fullest window that overlaps this one is the middle of that group.
    Window best = windows[last];
    for (std::size_t i = last; i-- > 0 && windows[i].first + kWindow >= windows[last].first;) {
      if (windows[i].count > best.count) best = windows[i];
    }
    double sum = 0;
    for (auto i = counts_.lower_bound(best.first); i != counts_.end() && i->first <= best.first + kWindow; ++i) {
      sum += double(i->first) * double(i->second);
    }
    return std::exp(kStep * sum / double(best.count));
  }
  return 0;
}

bool UnhiddenWidth::is_hidden(const OutlineWidth& width, double radius_m) const {
  if (!is_judged(width)) return false;
  const double limit_px = kNarrowSigmas * width.sigma_px + kNarrow_px + kSame * width.expected_px;
  return width.seen_px < this->radius_m() / radius_m * width.expected_px - limit_px;
}

std::size_t UnhiddenWidth::narrow_count() const {
  const double limit = std::log(radius_m() * (1 - kMuch)) / kStep;
  std::size_t count = 0;
  for (const auto& [step, widths] : counts_) count += step < limit ? widths : 0;
  return count;
}

}  // namespace twocone::vision
