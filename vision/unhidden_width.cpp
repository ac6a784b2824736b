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
// A width is too narrow if it is so by all of these together: its noise, its error from what is beside it, kSame, and
// the share by which blur widened the others.
constexpr double kNarrowSigmas = 3;
constexpr double kNarrow_px = 0.2;
// Blur widens a landmark of w pixels by kBlur_px2 / w, thus narrow and far ones most.
constexpr double kBlur_px2 = 0.7;

/// Returns the share by which blur widened what is seen with that width.
double widened_share(double seen_px) {
  const double width_px = (seen_px + std::sqrt(std::max(0.0, seen_px * seen_px - 4 * kBlur_px2))) / 2;
  return kBlur_px2 / (width_px * width_px);
}

bool is_usable(const OutlineWidth& width) {
  return width.seen_px > 0 && width.expected_px > 0 && std::isfinite(width.seen_px);
}

}  // namespace

void UnhiddenWidth::add(const OutlineWidth& width, double radius_m) {
  if (!is_usable(width)) return;
  Bin& bin = bins_[int(std::round(std::log(width.seen_px / width.expected_px * radius_m) / kStep))];
  ++bin.count;
  bin.sum_px += width.seen_px;
  ++count_;
  common_.reset();
}

const UnhiddenWidth::Common& UnhiddenWidth::common() const {
  if (!common_) common_ = find_common();
  return *common_;
}

UnhiddenWidth::Common UnhiddenWidth::find_common() const {
  struct Window {
    int first;
    std::size_t count;
  };
  std::vector<Window> windows;
  std::size_t most = 0;
  for (auto first = bins_.begin(); first != bins_.end(); ++first) {
    std::size_t count = 0;
    for (auto i = first; i != bins_.end() && i->first <= first->first + kWindow; ++i) count += i->second.count;
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
    double steps = 0;
    double sum_px = 0;
    for (auto i = bins_.lower_bound(best.first); i != bins_.end() && i->first <= best.first + kWindow; ++i) {
      steps += double(i->first) * double(i->second.count);
      sum_px += i->second.sum_px;
    }
    const auto count = double(best.count);
    return {.radius_m = std::exp(kStep * steps / count), .widened = widened_share(sum_px / count)};
  }
  return {};
}

double UnhiddenWidth::radius_m() const { return common().radius_m; }

bool UnhiddenWidth::is_hidden(const OutlineWidth& width, double radius_m) const {
  if (!is_usable(width)) return false;
  const Common& common = this->common();
  const double whole_px = common.radius_m / radius_m * width.expected_px;
  return width.seen_px < whole_px * (1 - kSame - common.widened) - kNarrowSigmas * width.sigma_px - kNarrow_px;
}

std::size_t UnhiddenWidth::narrow_count() const {
  const Common& common = this->common();
  const double limit_m = common.radius_m * (1 - kMuch - common.widened);
  std::size_t count = 0;
  for (const auto& [step, bin] : bins_) count += std::exp(kStep * step) < limit_m ? bin.count : 0;
  return count;
}

}  // namespace twocone::vision
