// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include "drivers/sim_povray/complaints.h"
#include "drivers/sim_povray/overhead.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {
namespace {

/// For people: smooth edges.
constexpr int kAntialias = 3;

double height_px(const OverheadView& view) {
  return std::round(view.width_px * (view.max_y_m - view.min_y_m) / (view.max_x_m - view.min_x_m));
}

void check(const OverheadView& view, double unit_m) {
  Complaints complaints;
  complaints.span("", 'x', view.min_x_m, view.max_x_m);
  complaints.span("", 'y', view.min_y_m, view.max_y_m);
  complaints.positive("height_m", view.height_m, "m");
  complaints.within("width_px", view.width_px, 1, kMaxSide_px);
  if (complaints.empty() && !(height_px(view) >= 1 && height_px(view) <= kMaxSide_px)) {
    complaints.add("the image would be {} pixels high, must be 1 to {}", height_px(view), kMaxSide_px);
  }
  complaints.positive("unit_m", unit_m, "m");
  complaints.raise("OverheadView");
}

}  // namespace

Result<Image> render_overhead(const std::filesystem::path& scene, double unit_m, const OverheadView& view,
                              const RenderSettings& render, const std::vector<std::filesystem::path>& scene_paths) {
  check(view, unit_m);
  check(render);
  auto text = Scene::read(scene);
  if (!text) return text.error();
  const PlaceSettings place{.scene = scene, .scene_paths = scene_paths, .render = render};
  const auto povray = confined_povray(place, *text);
  if (!povray) return povray.error();

  // An orthographic camera's image is `right` wide and `up` high, centred on `location`.
  const double x = (view.min_x_m + view.max_x_m) / 2 / unit_m;
  const double y = (view.min_y_m + view.max_y_m) / 2 / unit_m;
  const std::string seen = fmt::format(
      "{}\ncamera {{ orthographic location <{},{},{}> direction <0,-1,0> right <{},0,0> up <0,0,{}> }}\n", text->text(),
      x, view.height_m / unit_m, y, (view.max_x_m - view.min_x_m) / unit_m, (view.max_y_m - view.min_y_m) / unit_m);
  const auto image =
      povray->render(plain_image("overhead view", seen, view.width_px, int(height_px(view)), kAntialias), -1);
  if (!image) return image.error();
  return **image;
}

}  // namespace twocone::sim_povray
