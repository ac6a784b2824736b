// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/effects/camera_stage.h"
#include "drivers/sim_povray/effects/choice.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/povray.h"

namespace twocone::sim_povray {
namespace {

/// POV-Ray's highest.
constexpr int kHighestQuality = 11;
/// What one mirror and its surroundings show needs far less.
constexpr int kDeepReflections = 20;
constexpr int kDeepest = 256;
/// Pictures of which the middle processor time counts.
constexpr int kTimes = 3;

/// Processor time of all children that have been reaped.
double children_s() {
  struct rusage usage {};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void compare(const Image& everything, const Image& choice, const std::optional<MirrorSight>& mirror,
             Verification& result) {
  double sum = 0;
  for (int row = 0; row < everything.height_px; ++row) {
    for (int column = 0; column < everything.width_px; ++column) {
      if (mirror) {
        const double right_px = column - mirror->centre_column_px;
        const double down_px = row - mirror->centre_row_px;
        if (right_px * right_px + down_px * down_px > mirror->radius_px * mirror->radius_px) continue;
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

/// A scene with the robot of a seat.
struct Claimed {
  Scene scene;
  NamedBlock robot;
  std::string ending;  ///< of the names of its cameras
};

Result<Claimed> claim(Scene scene, const std::string& name) {
  auto robot = scene.robot(name);
  if (!robot) return robot.error();
  std::string ending = robot->name.substr(std::string_view("robot").size());
  return Claimed{std::move(scene), *std::move(robot), std::move(ending)};
}

class Verifier {
 public:
  Verifier(const PlaceSettings& place, const CameraSettings& size, Povray povray, Claimed everything, Claimed chosen,
           int quality, bool whole)
      : place_(place),
        size_(size),
        povray_(std::move(povray)),
        everything_(std::move(everything)),
        chosen_(std::move(chosen)),
        quality_(quality),
        whole_(whole) {}

  Result<Verification> run(const ViewSettings& view) const {
    const auto full_camera = everything_.scene.camera(view.camera_name + everything_.ending);
    if (!full_camera) return full_camera.error();
    const auto camera = chosen_.scene.camera(view.camera_name + chosen_.ending);
    if (!camera) return camera.error();
    std::optional<MirrorSight> mirror;
    if (!place_.render.whole_picture) {
      auto found = find_mirror(povray_, chosen_.scene, chosen_.robot, *camera, size_.width_px, size_.height_px, -1);
      if (!found) return found.error();
      mirror = std::move(*found);
    }

    Mould full = everything_.scene.mould({everything_.robot}, *full_camera, "");
    full.quality = kHighestQuality;
    const bool mirror_only = mirror && !whole_;
    Mould small = chosen_.scene.mould({chosen_.robot}, *camera, mirror_only ? mirror->mask : "");
    small.quality = quality_;
    if (mirror_only) small.window = mirror->window;

    const auto everything = take(std::move(full), everything_, view);
    if (!everything) return everything.error();
    const auto choice = take(std::move(small), chosen_, view);
    if (!choice) return choice.error();
    Verification result;
    result.view = view.camera_name;
    result.everything_s = everything->cpu_s;
    result.choice_s = choice->cpu_s;
    compare(pass_through(*everything->image), *choice->image, mirror, result);
    return result;
  }

 private:
  struct Taken {
    std::shared_ptr<const Image> image;
    double cpu_s = 0;
  };

  [[nodiscard]] Result<Taken> take(Mould mould, const Claimed& claimed, const ViewSettings& view) const {
    mould.width_px = size_.width_px;
    mould.height_px = size_.height_px;
    mould.antialias = view.antialias;
    const RenderJob job{fmt::format("verification of view {}", view.camera_name),
                        std::make_shared<const Mould>(std::move(mould)),
                        claimed.scene.pose_text({FloorMotion{}}, FloorMotion{}, place_.unit_m)};
    Taken taken;
    std::array<double, kTimes> times{};
    for (double& time : times) {
      const double before_s = children_s();
      const ImageResult image = povray_.render(job, -1);
      if (!image) return image.error();
      time = children_s() - before_s;
      taken.image = *image;
    }
    std::nth_element(times.begin(), times.begin() + kTimes / 2, times.end());
    taken.cpu_s = times[kTimes / 2];
    return taken;
  }

  const PlaceSettings& place_;
  const CameraSettings& size_;
  Povray povray_;
  Claimed everything_;
  Claimed chosen_;
  int quality_;
  bool whole_;
};

}  // namespace

Result<std::vector<Verification>> verify_effects(const PlaceSettings& place, const SeatSettings& seat,
                                                 const std::vector<ViewSettings>& views, const CameraSettings& size) {
  auto program = find_povray(place.render.povray);
  if (!program) return program.error();
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  const auto choice = choose_rendering(*scene, place.switches);
  if (!choice) return choice.error();
  const auto parsed = [&](std::string text) -> Result<Claimed> {
    auto changed = Scene::parse(std::move(text), scene->path());
    if (!changed) return changed.error();
    return claim(std::move(*changed), seat.name);
  };
  SceneSwitches deep;
  deep.reflection_depth = std::clamp(find_calls(*scene).max_trace_level.value_or(0), kDeepReflections, kDeepest);
  auto full = switched(*scene, deep);
  if (!full) return full.error();
  auto everything = parsed(std::move(*full));
  if (!everything) return everything.error();
  auto chosen = parsed(choice->text);
  if (!chosen) return chosen.error();

  const Verifier verifier(place, size, Povray(std::move(*program), place.scene, place.render.timeout),
                          std::move(*everything), std::move(*chosen), choice->quality, !choice->why_whole.empty());
  std::vector<Verification> results;
  for (const ViewSettings& view : views) {
    auto result = verifier.run(view);
    if (!result) return result.error();
    results.push_back(std::move(*result));
  }
  return results;
}

}  // namespace twocone::sim_povray
