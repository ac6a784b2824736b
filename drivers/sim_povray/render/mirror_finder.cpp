// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/mirror_finder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <future>
#include <vector>

#include <fmt/format.h>

namespace twocone::sim_povray {
namespace {

/// The fewest pixels of a mirror. Fewer are a highlight, not a usable mirror.
constexpr std::size_t kFewestPixels = 16;
/// The sphere shines with 2, so a tenth of it reflected is 0.2 in linear light: 124 in sRGB. Lacquer reflects less.
constexpr int kReflects = 120;
/// A circle's outermost pixel centres are within a pixel of it.
constexpr double kCircleError_px = 1;

/// Returns the scene with robot and camera lifted far away from everything, inside a glowing sphere that only mirrors
/// show. They are also moved sideways, because walls may be planes. The robot itself does not show in mirrors, so that
/// all of a mirror shows the sphere.
ViewTemplate probe(const Scene& scene, const NamedBlock& robot, const NamedBlock& camera, const char* colour) {
  const std::string& p = scene.prefix();
  ViewTemplate view_template{.scene = scene.with({{robot.begin, fmt::format("#declare {}Robot = ", p)},
                                                  {camera.begin, fmt::format("#declare {}View = ", p)}})};
  view_template.scene += fmt::format(
      "\n#declare {0}Low = min_extent({0}Robot); #declare {0}High = max_extent({0}Robot);\n"
      "#declare {0}Size = vlength({0}High - {0}Low) / 2; #declare {0}Middle = ({0}High + {0}Low) / 2;\n"
      // For a robot without an end.
      "#if ({0}Size > 1e5) #declare {0}Size = 100; #declare {0}Middle = <0,0,0>; #end\n"
      "#declare {0}Lift = <0.61, 1, 0.43> * 300 * {0}Size;\n"
      "object {{ {0}Robot no_reflection translate {0}Lift }}\n"
      "sphere {{ {0}Middle + {0}Lift, 2 * {0}Size hollow no_image no_shadow texture {{ pigment {{ color rgb {1} }} "
      "finish {{ ambient 0 diffuse 0 emission 2 }} }} }}\n"
      "camera {{ {0}View translate {0}Lift }}\n",
      p, colour);
  return view_template;
}

/// Returns which pixels see the sphere.
std::vector<char> different(const Image& a, const Image& b) {
  std::vector<char> result(a.bytes.size() / 3);
  for (std::size_t i = 0; i < a.bytes.size(); ++i) {
    if (std::abs(int(a.bytes[i]) - int(b.bytes[i])) >= kReflects) result[i / 3] = 1;
  }
  return result;
}

/// Returns the largest set of pixels that are connected by edges or corners.
std::vector<Spot> largest_patch(std::vector<char> set, int width_px, int height_px) {
  std::vector<Spot> largest;
  std::vector<int> open;
  for (int seed = 0; seed < int(set.size()); ++seed) {
    if (set[std::size_t(seed)] == 0) continue;
    std::vector<Spot> patch;
    open = {seed};
    set[std::size_t(seed)] = 0;
    while (!open.empty()) {
      const int column = open.back() % width_px, row = open.back() / width_px;
      open.pop_back();
      patch.push_back({double(column), double(row)});
      for (int r = std::max(0, row - 1); r <= std::min(height_px - 1, row + 1); ++r) {
        for (int c = std::max(0, column - 1); c <= std::min(width_px - 1, column + 1); ++c) {
          char& there = set[std::size_t(r) * width_px + c];
          if (there != 0) open.push_back(r * width_px + c);
          there = 0;
        }
      }
    }
    if (patch.size() > largest.size()) largest = std::move(patch);
  }
  return largest;
}

/// Returns the rim's circle through pixel centres. If the image cuts the mirror off, only the visible part of its rim
/// counts.
Circle rim_of(const std::vector<Spot>& patch, int width_px, int height_px) {
  const std::vector<Spot> hull = convex_hull(patch);
  const Circle around = enclosing_circle(hull);
  std::vector<Spot> rim;
  std::copy_if(hull.begin(), hull.end(), std::back_inserter(rim), [&](const Spot& s) {
    return s.column_px > 0 && s.row_px > 0 && s.column_px < width_px - 1 && s.row_px < height_px - 1;
  });
  constexpr std::size_t kEnough = 8;
  if (rim.size() == hull.size() || rim.size() < kEnough) return around;
  Circle fitted = fitted_circle(rim);
  const double farthest = farthest_px(hull, fitted.centre);
  if (!(std::abs(farthest - fitted.radius_px) < kCircleError_px)) return around;
  fitted.radius_px = farthest;
  return fitted;
}

Window window_around(const Circle& circle, int width_px, int height_px) {
  const auto column = [&](double c) { return std::clamp(int(c), 0, width_px - 1); };
  const auto row = [&](double r) { return std::clamp(int(r), 0, height_px - 1); };
  return {column(std::floor(circle.centre.column_px - circle.radius_px)),
          column(std::ceil(circle.centre.column_px + circle.radius_px)),
          row(std::floor(circle.centre.row_px - circle.radius_px)),
          row(std::ceil(circle.centre.row_px + circle.radius_px))};
}

/// Returns whether the masked image equals the whole one inside the circle, and is black beyond the teeth.
bool hides_the_rest(const Image& whole, const Image& masked, const Circle& circle) {
  constexpr double kEdge_px = 1;  // the side of a pixel on the edge depends on rounding
  constexpr int kBlack = 2;       // fog may lie in front of the mask
  for (int row = 0; row < whole.height_px; ++row) {
    for (int column = 0; column < whole.width_px; ++column) {
      const double off = std::hypot(column - circle.centre.column_px, row - circle.centre.row_px) - circle.radius_px;
      if (off > -kEdge_px && off < kMaskTeeth_px + kEdge_px) continue;
      const std::size_t at = 3 * (std::size_t(row) * whole.width_px + column);
      for (std::size_t i = at; i < at + 3; ++i) {
        if (off < 0 ? masked.bytes[i] != whole.bytes[i] : masked.bytes[i] > kBlack) return false;
      }
    }
  }
  return true;
}

/// Returns the same circle in an image of another size.
Circle scaled(const Circle& circle, double by) {
  return {{(circle.centre.column_px + 0.5) * by - 0.5, (circle.centre.row_px + 0.5) * by - 0.5}, circle.radius_px * by};
}

}  // namespace

Result<std::optional<MirrorSight>> find_mirror(const Povray& povray, const Scene& scene, const NamedBlock& robot,
                                               const NamedBlock& camera, int width_px, int height_px, int stop_fd) {
  const auto render = [&](ViewTemplate view_template, int width, int height) {
    view_template.width_px = width;
    view_template.height_px = height;
    view_template.quality = 8;  // all but media and radiosity
    return povray.render({fmt::format("looking for the mirror of view {}", camera.name),
                          std::make_shared<const ViewTemplate>(std::move(view_template)),
                          scene.pose_text({FloorMotion{}}, FloorMotion{}, 1)},
                         stop_fd);
  };
  // The images are rendered at the same time, each in a thread that lives until its process has ended. The third one is
  // for the test of the mask.
  constexpr int kSmaller = 4;
  const int small_width = (width_px + kSmaller - 1) / kSmaller;
  const int small_height = std::max(1, int(std::lround(double(height_px) * small_width / width_px)));
  auto green = std::async(std::launch::async,
                          [&] { return render(probe(scene, robot, camera, "<0,1,0>"), width_px, height_px); });
  auto plain = std::async(std::launch::async,
                          [&] { return render(scene.view_template({robot}, camera, ""), small_width, small_height); });
  const ImageResult seen_magenta = render(probe(scene, robot, camera, "<1,0,1>"), width_px, height_px);
  const ImageResult seen_green = green.get();
  const ImageResult unmasked = plain.get();
  for (const ImageResult* result : {&unmasked, &seen_magenta, &seen_green}) {
    if (!*result) return result->error();
  }

  const auto patch = largest_patch(different(**seen_magenta, **seen_green), width_px, height_px);
  if (patch.size() < kFewestPixels) return std::optional<MirrorSight>();
  Circle circle = rim_of(patch, width_px, height_px);
  circle.radius_px += 0.5;  // from the pixels' centres to their edges
  MirrorSight sight;
  sight.circle = circle;
  circle.radius_px += kRimMargin_px;
  sight.window = window_around({circle.centre, circle.radius_px + kMaskTeeth_px}, width_px, height_px);

  const auto mask = camera_mask(scene, camera, circle, width_px, height_px);
  if (!mask) return std::optional(sight);
  // POV-Ray may interpret the camera statement differently from this code, so the mask is tested on a small image.
  const Circle small = scaled(circle, double(small_width) / width_px);
  const auto small_mask = camera_mask(scene, camera, small, small_width, small_height);
  const ImageResult masked = small_mask
                                 ? render(scene.view_template({robot}, camera, *small_mask), small_width, small_height)
                                 : small_mask.error();
  if (!masked && masked.error().code != ErrorCode::kRefused) return masked.error();
  if (masked && hides_the_rest(**unmasked, **masked, small)) sight.mask = *mask;
  return std::optional(sight);
}

}  // namespace twocone::sim_povray
