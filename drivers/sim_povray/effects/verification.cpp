// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/effects.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/camera/camera_stage.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/povray/confined_povray.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {
namespace {

/// POV-Ray's highest quality.
constexpr int kHighestQuality = 11;
/// One mirror and its surroundings need far fewer.
constexpr int kDeepReflections = 20;
constexpr int kDeepest = 256;
/// Number of images; the median of their processor times counts.
constexpr int kTimes = 3;

void compare(const Image& everything, const Image& choice, const std::optional<MirrorSight>& mirror,
             Verification& result) {
  double sum = 0;
  for (int row = 0; row < everything.height_px; ++row) {
    for (int column = 0; column < everything.width_px; ++column) {
      if (mirror) {
        const double right_px = column - mirror->circle.centre.column_px;
        const double down_px = row - mirror->circle.centre.row_px;
        if (right_px * right_px + down_px * down_px > mirror->circle.radius_px * mirror->circle.radius_px) continue;
      }
      const std::size_t at = 3 * (std::size_t(row) * std::size_t(everything.width_px) + std::size_t(column));
      int most = 0;
      for (std::size_t i = at; i < at + 3; ++i) {
        const int difference = std::abs(int(everything.bytes[i]) - int(choice.bytes[i]));
        most = std::max(most, difference);
        sum += difference;
      }
      ++result.pixels;
      result.different += most > 0 ? 1 : 0;
      result.greatest = std::max(result.greatest, most);
    }
  }
  if (result.pixels > 0) result.mean = sum / (3.0 * result.pixels);
}

/// A scene with the robot of a session.
struct Claimed {
  Scene scene;
  NamedBlock robot;
};

Result<Claimed> claim(Scene scene, const std::string& name) {
  auto robot = scene.robot(name);
  if (!robot) return robot.error();
  return Claimed{std::move(scene), *std::move(robot)};
}

struct Verifier {
  const PlaceSettings& place;
  const CameraSettings& size;
  const RenderChoice& choice;
  Povray povray;
  Claimed everything;
  Claimed chosen;
  Claimed chosen_deep;  ///< the choice with the depth of reflections of `everything`

  Result<Verification> run(const ViewSettings& view) const {
    const auto full_camera = everything.scene.camera_of(everything.robot, view.camera_name);
    if (!full_camera) return full_camera.error();
    const auto camera = chosen.scene.camera_of(chosen.robot, view.camera_name);
    if (!camera) return camera.error();
    std::optional<MirrorSight> mirror;
    if (!place.render.whole_image) {
      auto found = find_mirror(povray, chosen.scene, chosen.robot, *camera, size.width_px, size.height_px, -1);
      if (!found) return found.error();
      mirror = std::move(*found);
    }

    ViewTemplate full = everything.scene.view_template({everything.robot}, *full_camera, "");
    full.quality = kHighestQuality;
    const auto full_image = take(std::move(full), everything, view, kTimes);
    if (!full_image) return full_image.error();
    const auto chosen_image = take(view_template_of(chosen, *camera, mirror), chosen, view, kTimes);
    if (!chosen_image) return chosen_image.error();
    const bool is_time_sure = full_image->least_s > chosen_image->most_s || chosen_image->least_s > full_image->most_s;
    Verification result{.view = view.camera_name,
                        .everything_s = full_image->middle_s,
                        .choice_s = chosen_image->middle_s,
                        .is_time_sure = is_time_sure};
    const Image whole = pass_through(*full_image->image);
    compare(whole, *chosen_image->image, mirror, result);
    if (result.different == 0) return result;
    if (auto explained = explain(view, mirror, whole, result); !explained) return explained.error();
    return result;
  }

  struct Taken {
    std::shared_ptr<const Image> image;
    double least_s = 0, middle_s = 0, most_s = 0;  ///< processor time
  };

  /// Returns the view template of the choice.
  [[nodiscard]] ViewTemplate view_template_of(const Claimed& claimed, const NamedBlock& camera,
                                              const std::optional<MirrorSight>& mirror) const {
    const bool mirror_only = mirror && choice.why_whole.empty();
    ViewTemplate view_template = claimed.scene.view_template({claimed.robot}, camera, mirror_only ? mirror->mask : "");
    view_template.quality = choice.quality;
    if (mirror_only) view_template.window = mirror->window;
    return view_template;
  }

  /// Finds the cause of a difference: random numbers, effects that the map switches off, or the depth of reflections,
  /// which is tested.
  Status explain(const ViewSettings& view, const std::optional<MirrorSight>& mirror, const Image& whole,
                 Verification& result) const {
    if (const Call* random = choice.calls.find(Feature::kRandom)) {
      result.why = fmt::format(
          "{}: {} draws random numbers, pixel by pixel, in the order in which POV-Ray makes them: two renderings "
          "differ wherever it shows, and a comparison shows nothing more",
          random->place(), random->word);
      return {};
    }
    const SceneSwitches& off = place.switches;
    if (!(off.shadows && off.area_lights && off.photons && off.radiosity && off.media)) {
      result.why = "the map's effects switch off what the scene has";
      result.is_asked_for = true;
      return {};
    }
    const auto camera = chosen_deep.scene.camera_of(chosen_deep.robot, view.camera_name);
    if (!camera) return camera.error();
    const auto deep = take(view_template_of(chosen_deep, *camera, mirror), chosen_deep, view, 1);
    if (!deep) return deep.error();
    Verification left;
    compare(whole, *deep->image, mirror, left);
    if (left.different == 0) {
      result.why = fmt::format(
          "reflections and refractions of more than {} surfaces, where max_trace_level of the scene or "
          "reflection_depth of the map ends: with those of everything (at least {}) the choice shows the same pixels",
          off.reflection_depth.value_or(choice.calls.max_trace_level.value_or(kUsualReflectionDepth)),
          kDeepReflections);
      result.is_asked_for = true;
    } else {
      result.why = fmt::format("not known: {} pixels differ also with the reflections of everything", left.different);
    }
    return {};
  }

  [[nodiscard]] Result<Taken> take(ViewTemplate view_template, const Claimed& claimed, const ViewSettings& view,
                                   int count) const {
    view_template.width_px = size.width_px;
    view_template.height_px = size.height_px;
    view_template.antialias = view.antialias;
    std::vector<double> times;
    const RenderJob job{fmt::format("verification of view {}", view.camera_name),
                        std::make_shared<const ViewTemplate>(std::move(view_template)),
                        claimed.scene.pose_text({FloorMotion{}}, FloorMotion{}, place.unit_m),
                        [&times](const base::ProcessUse& use) { times.push_back(seconds(use.cpu)); }};
    std::shared_ptr<const Image> last;
    for (int i = 0; i < count; ++i) {
      const ImageResult image = povray.render(job, -1);
      if (!image) return image.error();
      last = *image;
    }
    times.resize(std::size_t(count));  // where the system does not report the use
    std::sort(times.begin(), times.end());
    return Taken{std::move(last), times.front(), times[times.size() / 2], times.back()};
  }
};

}  // namespace

Result<std::vector<Verification>> verify_effects(const PlaceSettings& place, const SessionSettings& session,
                                                 const std::vector<ViewSettings>& views, const CameraSettings& size) {
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  const SceneAccess access(place.scene, place.scene_paths);
  const auto choice = choose_rendering(*scene, place.switches, access);
  if (!choice) return choice.error();
  auto povray = confined_povray(place, choice->calls);
  if (!povray) return povray.error();
  const SceneCalls written = find_calls(*scene, access);
  const auto claim_with = [&](const SceneSwitches& switches) -> Result<Claimed> {
    auto text = switched(*scene, written, switches);
    if (!text) return text.error();
    auto changed = Scene::parse(*std::move(text), scene->path());
    if (!changed) return changed.error();
    return claim(*std::move(changed), session.name);
  };
  SceneSwitches deep{.reflection_depth = std::clamp(written.max_trace_level.value_or(0), kDeepReflections, kDeepest)};
  auto everything = claim_with(deep);
  if (!everything) return everything.error();
  auto chosen = claim(choice->scene, session.name);
  if (!chosen) return chosen.error();
  SceneSwitches chosen_deep = place.switches;
  chosen_deep.reflection_depth = deep.reflection_depth;
  auto with_depth = claim_with(chosen_deep);
  if (!with_depth) return with_depth.error();

  const Verifier verifier{
      place, size, *choice, *std::move(povray), *std::move(everything), *std::move(chosen), *std::move(with_depth)};
  std::vector<Verification> results;
  for (const ViewSettings& view : views) {
    auto result = verifier.run(view);
    if (!result) return result.error();
    results.push_back(std::move(*result));
  }
  return results;
}

}  // namespace twocone::sim_povray
