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
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {
namespace {

/// POV-Ray's highest quality.
constexpr int kHighestQuality = 11;
/// Depth of reflections of `everything`. One mirror and its surroundings need far less.
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

struct Verifier {
  const PlaceSettings& place;
  const std::string& robot_name;
  const CameraSettings& size;
  const RenderChoice& choice;
  Povray povray;
  Scene everything;
  Scene chosen_deep;  ///< the choice with the depth of reflections of `everything`

  Result<Verification> run(const ViewSettings& view) const {
    const auto robot = choice.scene.robot(robot_name);
    if (!robot) return robot.error();
    const auto camera = choice.scene.camera_of(*robot, view.camera_name);
    if (!camera) return camera.error();
    std::optional<MirrorSight> mirror;
    if (!place.render.whole_image) {
      auto found = find_mirror(povray, choice.scene, *robot, *camera, size.width_px, size.height_px, -1);
      if (!found) return found.error();
      mirror = std::move(*found);
    }

    const auto full_image = take(everything, view, nullptr, kHighestQuality, kTimes);
    if (!full_image) return full_image.error();
    const MirrorSight* const limits = mirror && choice.why_whole.empty() ? &*mirror : nullptr;
    const auto chosen_image = take(choice.scene, view, limits, choice.quality, kTimes);
    if (!chosen_image) return chosen_image.error();
    const bool is_time_sure = full_image->least_s > chosen_image->most_s || chosen_image->least_s > full_image->most_s;
    Verification result{.view = view.camera_name,
                        .everything_s = full_image->middle_s,
                        .choice_s = chosen_image->middle_s,
                        .is_time_sure = is_time_sure};
    const Image whole = pass_through(*full_image->image);
    compare(whole, *chosen_image->image, mirror, result);
    if (result.different == 0) return result;
    if (auto explained = explain(view, mirror, limits, whole, result); !explained) return explained.error();
    return result;
  }

  struct Taken {
    std::shared_ptr<const Image> image;
    double least_s = 0, middle_s = 0, most_s = 0;  ///< processor time
  };

  /// Finds the cause of a difference: random numbers, effects that the map switches off, or the depth of reflections.
  /// The depth is tested.
  Status explain(const ViewSettings& view, const std::optional<MirrorSight>& mirror, const MirrorSight* limits,
                 const Image& whole, Verification& result) const {
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
    const auto deep = take(chosen_deep, view, limits, choice.quality, 1);
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

  /// Renders a scene several times. @param limits the mirror outside which nothing is rendered; nullptr: all is
  [[nodiscard]] Result<Taken> take(const Scene& scene, const ViewSettings& view, const MirrorSight* limits, int quality,
                                   int count) const {
    const auto robot = scene.robot(robot_name);
    if (!robot) return robot.error();
    const auto camera = scene.camera_of(*robot, view.camera_name);
    if (!camera) return camera.error();
    ViewTemplate view_template = scene.view_template({*robot}, *camera, limits == nullptr ? "" : limits->mask);
    view_template.width_px = size.width_px;
    view_template.height_px = size.height_px;
    view_template.antialias = view.antialias;
    view_template.quality = quality;
    if (limits != nullptr) view_template.window = limits->window;
    std::vector<double> times;
    const RenderJob job{fmt::format("verification of view {}", view.camera_name),
                        std::make_shared<const ViewTemplate>(std::move(view_template)),
                        scene.pose_text({FloorMotion{}}, FloorMotion{}, place.unit_m),
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
  const auto scene_with = [&](const SceneSwitches& switches) -> Result<Scene> {
    auto text = switched(*scene, written, switches);
    if (!text) return text.error();
    return Scene::parse(*std::move(text), scene->path());
  };
  SceneSwitches deep{.reflection_depth = std::clamp(written.max_trace_level.value_or(0), kDeepReflections, kDeepest)};
  auto everything = scene_with(deep);
  if (!everything) return everything.error();
  if (const auto robot = everything->robot(session.name); !robot) return robot.error();
  SceneSwitches chosen_deep = place.switches;
  chosen_deep.reflection_depth = deep.reflection_depth;
  auto with_depth = scene_with(chosen_deep);
  if (!with_depth) return with_depth.error();

  const Verifier verifier{
      place, session.name, size, *choice, *std::move(povray), *std::move(everything), *std::move(with_depth)};
  std::vector<Verification> results;
  for (const ViewSettings& view : views) {
    auto result = verifier.run(view);
    if (!result) return result.error();
    results.push_back(std::move(*result));
  }
  return results;
}

}  // namespace twocone::sim_povray
