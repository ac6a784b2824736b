// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/bvh.h"

#include <numeric>
#include <utility>

namespace twocone::sim_povray {
namespace {

constexpr int kMostInLeaf = 4;
constexpr int kBins = 16;

double half_area(const Bounds3& box) {
  const Vec3 d = box.high - box.low;
  return d.x * d.y + d.y * d.z + d.z * d.x;
}

double middle(const Bounds3& box, std::size_t axis) { return component(box.low, axis) + component(box.high, axis); }

}  // namespace

Bvh::Bvh(std::vector<Bounds3> boxes) : order_(boxes.size()), boxes_(std::move(boxes)) {
  if (boxes_.empty()) return;
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(2 * boxes_.size());
  nodes_.emplace_back();
  build(0, 0, int(boxes_.size()), 1);
}

void Bvh::build(std::size_t node, int first, int count, std::size_t depth) {
  const auto box = [&](int i) -> const Bounds3& { return boxes_[std::size_t(order_[std::size_t(i)])]; };
  Bounds3 all = box(first);
  for (int i = first + 1; i < first + count; ++i) all = around(all, box(i));
  nodes_[node].bounds = all;

  double best_cost = count * half_area(all);
  std::optional<std::size_t> best_axis;
  double best_at = 0;
  for (std::size_t axis = 0; axis < 3 && count > 1; ++axis) {
    double low = middle(box(first), axis);
    double high = low;
    for (int i = first; i < first + count; ++i) {
      low = std::min(low, middle(box(i), axis));
      high = std::max(high, middle(box(i), axis));
    }
    if (!(high > low)) continue;
    for (int bin = 1; bin < kBins; ++bin) {
      const double at = low + (high - low) * bin / kBins;
      std::array<int, 2> counts{};
      std::array<Bounds3, 2> sides{};
      for (int i = first; i < first + count; ++i) {
        const std::size_t side = middle(box(i), axis) < at ? 0 : 1;
        sides[side] = counts[side]++ == 0 ? box(i) : around(sides[side], box(i));
      }
      if (counts[0] == 0 || counts[1] == 0) continue;
      const double cost = half_area(all) + counts[0] * half_area(sides[0]) + counts[1] * half_area(sides[1]);
      if (cost >= best_cost && (best_axis || count <= kMostInLeaf)) continue;
      best_cost = cost;
      best_axis = axis;
      best_at = at;
    }
  }
  // Boxes with one common middle cannot be parted, and search() holds as many open nodes as levels.
  if (!best_axis || depth + 2 >= kMostDepth) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  const auto begin = order_.begin() + first;
  // A stable order makes the hierarchy, and so the choice between surfaces at one distance, the same everywhere.
  const auto parted = std::stable_partition(
      begin, begin + count, [&](int i) { return middle(boxes_[std::size_t(i)], *best_axis) < best_at; });
  const int left = int(parted - begin);
  const int children = int(nodes_.size());
  nodes_[node].first = children;
  nodes_.resize(nodes_.size() + 2);
  build(std::size_t(children), first, left, depth + 1);
  build(std::size_t(children) + 1, first + left, count - left, depth + 1);
}

}  // namespace twocone::sim_povray
