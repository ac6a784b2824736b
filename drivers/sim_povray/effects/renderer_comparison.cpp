// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/native/native_renderer.h"
#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {
namespace {

constexpr int kDarkening = 3;

/// Returns the image, darkened, with some of its pixels in red.
Image marked(Image image, const std::vector<std::size_t>& pixels) {
  for (std::uint8_t& byte : image.bytes) byte = std::uint8_t(byte / kDarkening);
  for (const std::size_t pixel : pixels) {
    image.bytes[3 * pixel] = 255;
    image.bytes[3 * pixel + 1] = image.bytes[3 * pixel + 2] = 0;
  }
  return image;
}

}  // namespace

Result<RendererComparison> compare_renderers(const PlaceSettings& place, const SessionSettings& session,
                                             const ViewSettings& view, const CameraSettings& size) {
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  SceneAccess access(place.scene, place.scene_paths);
  const auto choice = choose_rendering(*scene, place.switches, access);
  if (!choice) return choice.error();
  const auto povray = confined_povray(place, choice->calls);
  if (!povray) return povray.error();
  const auto robot = choice->scene.robot(session.name);
  if (!robot) return robot.error();
  const auto camera = choice->scene.camera_of(*robot, view.camera_name);
  if (!camera) return camera.error();
  std::optional<MirrorSight> mirror;
  if (!place.render.whole_image && choice->why_whole.empty()) {
    auto found = find_mirror(*povray, choice->scene, *robot, *camera, size.width_px, size.height_px, -1);
    if (!found) return found.error();
    mirror = *std::move(found);
  }
  ViewTemplate view_template = choice->scene.view_template({*robot}, *camera, mirror ? mirror->mask : "");
  view_template.carrier = 0;
  view_template.width_px = size.width_px;
  view_template.height_px = size.height_px;
  view_template.quality = choice->quality;
  view_template.one_shot = choice->one_shot;
  if (mirror) view_template.window = mirror->window;

  RendererComparison result{.view = view.camera_name};
  const auto native = NativeView::make(view_template, choice->scene.path(), include_reader(access));
  if (!native) {
    result.unknown = native.error().message;
    return result;
  }
  const std::string pose = choice->scene.pose_text({FloorMotion{}}, FloorMotion{}, place.unit_m);
  const auto expected = povray->render({"comparison of view " + view.camera_name,
                                        std::make_shared<const ViewTemplate>(std::move(view_template)),
                                        pose,
                                        {}},
                                       -1);
  if (!expected) return expected.error();
  const auto pixels = differing_pixels(plain_image_of(**native, parse_poses(pose).value()), **expected);
  result.pixels = (*native)->mirror_pixels();
  if (result.pixels == 0) result.pixels = (*expected)->bytes.size() / 3;
  result.different = pixels.size();
  result.is_trusted = double(pixels.size()) <= NativeRenderer::kMostDifferent * double(result.pixels);
  result.differences = marked(**expected, pixels);
  return result;
}

}  // namespace twocone::sim_povray
