// SPDX-License-Identifier: Apache-2.0
#include "vision/dense/row_kernels.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/dense/row_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// The lines up to HWY_ONCE are compiled once for each instruction set; the compiler vectorises the plain loops.
HWY_BEFORE_NAMESPACE();
namespace twocone::vision::HWY_NAMESPACE {
namespace {

using Byte = std::uint8_t;

void DifferenceCosts(Byte value, const Byte* HWY_RESTRICT others, const Byte* HWY_RESTRICT floors, std::size_t count,
                     Byte most, Byte* HWY_RESTRICT costs) {
  for (std::size_t i = 0; i < count; ++i) {
    const Byte high = others[i] > value ? others[i] : value;
    const Byte low = others[i] > value ? value : others[i];
    const auto difference = static_cast<Byte>(high - low);
    const Byte cut = difference < most ? difference : most;
    costs[i] = cut > floors[i] ? cut : floors[i];
  }
}

void AddThree(const Byte* HWY_RESTRICT a, const Byte* HWY_RESTRICT b, const Byte* HWY_RESTRICT c, std::size_t count,
              Byte* HWY_RESTRICT sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = static_cast<Byte>(a[i] + b[i] + c[i]);
}

void QuarterOfThree(const Byte* HWY_RESTRICT a, const Byte* HWY_RESTRICT b, const Byte* HWY_RESTRICT c,
                    std::size_t count, Byte* HWY_RESTRICT quarters) {
  for (std::size_t i = 0; i < count; ++i) quarters[i] = static_cast<Byte>((a[i] + b[i] + c[i]) >> 2);
}

void AddFour(const Byte* HWY_RESTRICT a, const Byte* HWY_RESTRICT b, const Byte* HWY_RESTRICT c,
             const Byte* HWY_RESTRICT d, std::size_t count, std::uint16_t* HWY_RESTRICT sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = static_cast<std::uint16_t>(a[i] + b[i] + c[i] + d[i]);
}

Byte Least(Byte a, Byte b) { return a < b ? a : b; }

void PathStep(const Byte* HWY_RESTRICT costs, const Byte* HWY_RESTRICT previous, std::size_t disparities,
              const Penalties& penalties, Byte* HWY_RESTRICT path) {
  Byte least = 255;
  for (std::size_t d = 0; d < disparities; ++d) least = previous[d] < least ? previous[d] : least;
  const auto jump = static_cast<Byte>(least + penalties.more);
  const Byte one = penalties.one;
  const std::size_t last = disparities - 1;
  path[0] = static_cast<Byte>(costs[0] + Least(Least(previous[0], jump), static_cast<Byte>(previous[1] + one)) - least);
  for (std::size_t d = 1; d < last; ++d) {
    const auto below = static_cast<Byte>(previous[d - 1] + one);
    const auto above = static_cast<Byte>(previous[d + 1] + one);
    const Byte side = below < above ? below : above;
    const Byte straight = previous[d] < jump ? previous[d] : jump;
    const Byte best = side < straight ? side : straight;
    path[d] = static_cast<Byte>(costs[d] + best - least);
  }
  path[last] = static_cast<Byte>(
      costs[last] + Least(Least(previous[last], jump), static_cast<Byte>(previous[last - 1] + one)) - least);
}

void SumWindows(std::span<const MatchedRow> rows, const float* HWY_RESTRICT here, const ExpectedSlants& slants,
                std::size_t width, std::size_t reach, float same_px, WindowSums& sums) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<float, 16> tag;
  const auto per_px = hn::Set(tag, 1 / same_px);
  const auto one = hn::Set(tag, 1.F);
  const auto zero = hn::Zero(tag);
  const auto least = hn::Set(tag, 1e-6F);
  const auto most_slant = hn::Set(tag, slants.most_px);
  const auto other = hn::Set(tag, slants.other_px);
  const std::ptrdiff_t most = std::ptrdiff_t(reach);
  for (std::size_t i = 0; i < width; i += hn::Lanes(tag)) {
    const auto middle = hn::LoadU(tag, here + i);
    const auto level = hn::Clamp(hn::Mul(middle, hn::LoadU(tag, slants.level + i)), hn::Neg(most_slant), most_slant);
    auto from_upright = zero, from_level = zero;
    for (std::ptrdiff_t by = -most; by <= most; ++by) {
      const auto off = hn::Sub(hn::LoadU(tag, here + std::ptrdiff_t(i) + by), middle);
      const auto off_level = hn::NegMulAdd(level, hn::Set(tag, static_cast<float>(by)), off);
      from_upright = hn::Add(from_upright, hn::Min(other, hn::Abs(off)));
      from_level = hn::Add(from_level, hn::Min(other, hn::Abs(off_level)));
    }
    const auto slant = hn::IfThenElseZero(hn::Lt(from_level, from_upright), level);
    auto n = zero, d = zero, dd = zero;
    auto uu = zero, ug = zero, gg = zero, ur = zero, gr = zero, rr = zero;
    for (const MatchedRow& row : rows) {
      auto row_n = zero, row_u = zero, row_g = zero, row_r = zero;
      for (std::ptrdiff_t by = -most; by <= most; ++by) {
        const std::ptrdiff_t at = std::ptrdiff_t(i) + by;
        const auto offset = hn::Set(tag, static_cast<float>(by));
        const auto its_u = hn::LoadU(tag, row.u + at);
        const auto its_g = hn::LoadU(tag, row.g + at);
        const auto its_r = hn::LoadU(tag, row.r + at);
        const auto off = hn::NegMulAdd(slant, offset, hn::Sub(hn::LoadU(tag, row.disparity + at), middle));
        const auto apart = hn::Mul(off, per_px);
        const auto near = hn::Max(zero, hn::Sub(one, hn::Mul(apart, apart)));
        const auto w = hn::Mul(hn::Mul(near, near), hn::LoadU(tag, row.weight + at));
        const auto wu = hn::Mul(w, its_u);
        const auto wg = hn::Mul(w, its_g);
        const auto wr = hn::Mul(w, its_r);
        const auto wd = hn::Mul(w, off);
        row_n = hn::Add(row_n, w);
        row_u = hn::Add(row_u, wu);
        row_g = hn::Add(row_g, wg);
        row_r = hn::Add(row_r, wr);
        d = hn::Add(d, wd);
        dd = hn::MulAdd(wd, off, dd);
        uu = hn::MulAdd(wu, its_u, uu);
        ug = hn::MulAdd(wu, its_g, ug);
        gg = hn::MulAdd(wg, its_g, gg);
        ur = hn::MulAdd(wu, its_r, ur);
        gr = hn::MulAdd(wg, its_r, gr);
        rr = hn::MulAdd(wr, its_r, rr);
      }
      const auto over_n = hn::Div(one, hn::Max(row_n, least));
      const auto mean_u = hn::Mul(row_u, over_n);
      const auto mean_g = hn::Mul(row_g, over_n);
      const auto mean_r = hn::Mul(row_r, over_n);
      n = hn::Add(n, row_n);
      uu = hn::NegMulAdd(row_u, mean_u, uu);
      ug = hn::NegMulAdd(row_u, mean_g, ug);
      gg = hn::NegMulAdd(row_g, mean_g, gg);
      ur = hn::NegMulAdd(row_u, mean_r, ur);
      gr = hn::NegMulAdd(row_g, mean_r, gr);
      rr = hn::NegMulAdd(row_r, mean_r, rr);
    }
    const auto put = [&](WindowSums::Sum sum, auto value) HWY_ATTR { hn::StoreU(value, tag, sums.of[sum].data() + i); };
    put(WindowSums::kN, n);
    put(WindowSums::kD, d);
    put(WindowSums::kUu, uu);
    put(WindowSums::kUg, ug);
    put(WindowSums::kGg, gg);
    put(WindowSums::kUr, ur);
    put(WindowSums::kGr, gr);
    put(WindowSums::kRr, rr);
    put(WindowSums::kDd, dd);
  }
}

}  // namespace
}  // namespace twocone::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace twocone::vision {

HWY_EXPORT(DifferenceCosts);
HWY_EXPORT(AddThree);
HWY_EXPORT(QuarterOfThree);
HWY_EXPORT(AddFour);
HWY_EXPORT(PathStep);
HWY_EXPORT(SumWindows);

void difference_costs(std::uint8_t value, const std::uint8_t* others, const std::uint8_t* floors, std::size_t count,
                      std::uint8_t most, std::uint8_t* costs) {
  HWY_DYNAMIC_DISPATCH(DifferenceCosts)(value, others, floors, count, most, costs);
}
void add_three(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, std::size_t count,
               std::uint8_t* sums) {
  HWY_DYNAMIC_DISPATCH(AddThree)(a, b, c, count, sums);
}
void quarter_of_three(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, std::size_t count,
                      std::uint8_t* quarters) {
  HWY_DYNAMIC_DISPATCH(QuarterOfThree)(a, b, c, count, quarters);
}
void add_four(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, const std::uint8_t* d,
              std::size_t count, std::uint16_t* sums) {
  HWY_DYNAMIC_DISPATCH(AddFour)(a, b, c, d, count, sums);
}
void path_step(const std::uint8_t* costs, const std::uint8_t* previous, std::size_t disparities,
               const Penalties& penalties, std::uint8_t* path) {
  HWY_DYNAMIC_DISPATCH(PathStep)(costs, previous, disparities, penalties, path);
}
void sum_windows(std::span<const MatchedRow> rows, const float* here, const ExpectedSlants& slants, std::size_t width,
                 std::size_t reach, float same_px, WindowSums& sums) {
  HWY_DYNAMIC_DISPATCH(SumWindows)(rows, here, slants, width, reach, same_px, sums);
}

}  // namespace twocone::vision
#endif  // HWY_ONCE
