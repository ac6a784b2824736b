// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "drivers/sim_povray/render/native/shapes.h"
#include "drivers/sim_povray/scene/vector3.h"

namespace twocone::sim_povray {

/// A bounding volume hierarchy over boxes, by the surface area heuristic (Wald 2007, "On fast construction of SAH-based
/// bounding volume hierarchies").
class Bvh {
 public:
  struct Node {
    Bounds3 bounds;
    int first = 0;  ///< of order(), or the left child, which the right one follows
    int count = 0;  ///< boxes of a leaf; 0: an inner node
  };

  Bvh() = default;
  explicit Bvh(std::vector<Bounds3> boxes);

  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  /// Indices of the boxes, leaf by leaf.
  [[nodiscard]] const std::vector<int>& order() const { return order_; }
  /// The boxes themselves, by index.
  [[nodiscard]] const std::vector<Bounds3>& boxes() const { return boxes_; }
  [[nodiscard]] bool empty() const { return nodes_.empty(); }

  /// Calls `visit(index)` for the boxes that the ray may meet in [t_min, t_max], roughly from near to far. `visit`
  /// returns true to end the search; it may lower `t_max`.
  template <class Visit>
  void search(const Ray& ray, double t_min, const double& t_max, Visit visit) const {
    if (nodes_.empty()) return;
    const Vec3 inverse{1 / ray.direction.x, 1 / ray.direction.y, 1 / ray.direction.z};
    std::array<int, kMostDepth> open;
    std::size_t depth = 0;
    open[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[std::size_t(open[--depth])];
      if (entry(node.bounds, ray.origin, inverse, t_min, t_max) == kMissed) continue;
      if (node.count == 0) {
        const double left = entry(nodes_[std::size_t(node.first)].bounds, ray.origin, inverse, t_min, t_max);
        const double right = entry(nodes_[std::size_t(node.first) + 1].bounds, ray.origin, inverse, t_min, t_max);
        const bool left_first = left <= right;
        if (std::max(left, right) < kMissed) open[depth++] = left_first ? node.first + 1 : node.first;
        if (std::min(left, right) < kMissed) open[depth++] = left_first ? node.first : node.first + 1;
        continue;
      }
      for (int i = node.first; i < node.first + node.count; ++i) {
        if (visit(order_[std::size_t(i)])) return;
      }
    }
  }

 private:
  static constexpr std::size_t kMostDepth = 64;
  static constexpr double kMissed = std::numeric_limits<double>::infinity();

  /// Returns where the ray enters the box, at least t_min; kMissed if it does not within [t_min, t_max].
  static double entry(const Bounds3& box, const Vec3& origin, const Vec3& inverse, double t_min, double t_max) {
    // A ray in the plane of a face gives 0 * infinity = NaN there, and fmin and fmax ignore NaN: it counts as inside.
    double low = t_min;
    double high = t_max;
    const auto cut = [&](double from, double to, double start, double slope) {
      const double a = (from - start) * slope;
      const double b = (to - start) * slope;
      low = std::max(low, a < b ? a : b);  // NaN in the second argument of max and min: the first one stays
      high = std::min(high, a < b ? b : a);
    };
    cut(box.low.x, box.high.x, origin.x, inverse.x);
    cut(box.low.y, box.high.y, origin.y, inverse.y);
    cut(box.low.z, box.high.z, origin.z, inverse.z);
    return low <= high ? low : kMissed;
  }

  void build(std::size_t node, int first, int count, std::size_t depth);

  std::vector<Node> nodes_;
  std::vector<int> order_;
  std::vector<Bounds3> boxes_;
};

}  // namespace twocone::sim_povray
