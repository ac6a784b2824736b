// SPDX-License-Identifier: Apache-2.0
#include "apps/look/look.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stop_token>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/look/checks.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runs/loop/start_check.h"
#include "drivers/sim_povray/scene_views.h"

namespace twocone::look {
namespace {

/// The plan shows this much around the map's bounds: the walls.
constexpr double kMargin_m = 0.25;
/// The plan is cut this far over the robot and all landmarks, or just below a ceiling that is lower.
constexpr double kAbove_m = 0.25;
constexpr double kBelowCeiling_m = 0.02;
constexpr int kPlanWidth_px = 1400;
constexpr int kPlanHeight_px = 1400;
/// POV-Ray renders fewer pixels: the chess set of its examples at full size takes it more than two minutes.
constexpr int kPovrayShare = 2;
constexpr std::string_view kPlan = "above.svg";

std::filesystem::path image_file(const std::filesystem::path& folder, const std::string& camera) {
  return folder / (camera + ".png");
}

/// Returns the robot's world with all that would change or prevent its first images switched off.
Result<drivers::RobotSettings> settings_of(const config::Robot& robot, const config::Map& map,
                                           const LookOptions& options) {
  if (!config::is_simulated(robot)) {
    return Error(ErrorCode::kRefused,
                 "{}: no part has driver {}: there is no scene to look at; `twocone doctor` examines a real robot",
                 robot.file.string(), drivers::kSimPovray);
  }
  if (!map.scene) {
    return Error(ErrorCode::kRefused, "{}: scene is missing: the POV-Ray file; look compares the map with it",
                 map.file.string());
  }
  drivers::RobotSettings settings = config::to_robot_settings(robot, map, 1);
  drivers::SimulatedWorld& world = *settings.world;
  if (!std::exchange(world.attach, {}).empty()) world.session.map_outline.clear();
  world.place = config::to_place(map);
  if (options.renderer) world.place.render.renderer = *options.renderer;
  world.session.body.radius_m = 0;
  const auto lose_none = [](drivers::CameraPart& part) {
    part.effects.drop_probability = part.effects.late_probability = part.effects.stamp_late_s = 0;
  };
  lose_none(settings.lower);
  lose_none(settings.upper);
  for (drivers::OtherCamera& other : settings.others) lose_none(other.part);
  return settings;
}

struct FirstImages {
  std::shared_ptr<const Image> lower, upper;
};

/// Writes what each camera sees at the start.
Result<FirstImages> first_images(const drivers::RobotSettings& settings, const std::filesystem::path& out, Look& look) {
  auto robot = drivers::open_robot(settings);
  if (!robot) return robot.error();
  if (const Status started = robot->start(settings.lower.settings, settings.upper.settings); !started) {
    return started.error();
  }
  const auto pair = robot->next_frame(robot->pace().frame_timeout);
  if (!pair) return pair.error();
  FirstImages images;
  const auto store = [&](const std::string& camera, const Frame& frame) -> ImageResult {
    auto image = frame.image(settings.world->place.render.timeout);
    if (!image) return with_name(camera, image.error());
    runlog::write_image(image_file(out, camera), **image);
    look.files.push_back(image_file(out, camera));
    return image;
  };
  for (const auto& [camera, frame, image] :
       {std::tuple{"lower", &pair->lower, &images.lower}, std::tuple{"upper", &pair->upper, &images.upper}}) {
    const auto stored = store(camera, *frame);
    if (!stored) return stored.error();
    *image = *stored;
  }
  for (const NamedFrame& other : robot->other_frames()) {
    if (const auto stored = store(other.name, other.frame); !stored) return stored.error();
  }
  return images;
}

/// Compares the start with where the scene shows the robot.
void check_start_place(const Subject& subject, const drivers::SimulatedWorld& world, Look& look) {
  const std::string at = subject.place_of_start();
  const auto shown = sim_povray::shown_camera(world.place, world.session.name, "lower", std::stop_token());
  if (!shown) {
    look.notes.push_back(fmt::format("note: {}: start was not compared with where the scene shows the robot: {}", at,
                                     shown.error().message));
    return;
  }
  const auto warning = runs::compare_start(subject.robot, *shown, at);
  if (warning && !*warning) {
    look.checked.push_back(fmt::format("start: against where the scene shows the robot, to {:.0f} mm and {} degrees",
                                       1000 * runs::kStartWarning_m, runs::kStartWarning_deg));
    return;
  }
  look.findings.push_back(
      {Disagreement::kStartPlace, warning ? **warning : warning.error().message, {shown->x_m, shown->y_m}, {}});
}

/// Returns what the plan shows: the bounds with a margin.
sim_povray::OverheadView plan_view(const Subject& subject, const sim_povray::SceneGeometry* scene) {
  const config::Bounds& bounds = subject.map.bounds;
  sim_povray::OverheadView view{.min_x_m = bounds.min_x_m - kMargin_m,
                                .max_x_m = bounds.max_x_m + kMargin_m,
                                .min_y_m = bounds.min_y_m - kMargin_m,
                                .max_y_m = bounds.max_y_m + kMargin_m};
  const double tallness = (view.max_y_m - view.min_y_m) / (view.max_x_m - view.min_x_m);
  view.width_px = std::max(1, int(std::min(double(kPlanWidth_px), kPlanHeight_px / tallness)));
  if (scene == nullptr) view.width_px = std::max(1, view.width_px / kPovrayShare);
  view.height_m = plan_height_m(subject, scene);
  return view;
}

}  // namespace

std::string Subject::place_of_start() const {
  const auto found = places.find("start");
  return found == places.end() ? robot.file.string() : found->second;
}

std::string Subject::place_of(std::string_view list, std::size_t index) const {
  const auto found = places.find(fmt::format("map.{}[{}]", list, index));
  return found == places.end() ? map.file.string() : found->second;
}

double Subject::robot_height_m() const {
  const config::Rig& rig = robot.rig;
  return rig.lens_height_m + rig.lower.lens_to_tip_m + rig.mirror_separation_m +
         rig.upper.mirror_radius_m / std::tan(rig.upper.apex_rad / 2);
}

double plan_height_m(const Subject& subject, const sim_povray::SceneGeometry* scene) {
  const double robot_m = subject.robot_height_m();
  double tallest_m = robot_m;
  for (const Landmark& landmark : subject.map.landmarks) tallest_m = std::max(tallest_m, landmark.top_m);
  const double height_m = tallest_m + kAbove_m;
  if (scene == nullptr) return height_m;
  const localisation::Pose start = config::to_start_pose(subject.robot);
  const auto ceiling = scene->cast({start.x_m, start.y_m, robot_m}, {0, 0, 1}, height_m - robot_m);
  return ceiling ? robot_m + std::max(ceiling->distance_m - kBelowCeiling_m, 0.0) : height_m;
}

std::vector<std::filesystem::path> files_of(const config::Robot& robot, const std::filesystem::path& out) {
  std::vector<std::filesystem::path> files;
  for (const std::string& camera : config::camera_names(robot)) files.push_back(image_file(out, camera));
  files.push_back(out / kPlan);
  return files;
}

Result<Look> look(const config::Robot& robot, const config::Map& map, const LookOptions& options) {
  auto settings = settings_of(robot, map, options);
  if (!settings) return settings.error();
  drivers::SimulatedWorld& world = *settings->world;
  Look result;
  std::mutex mutex;  // a renderer may call from any thread
  world.place.render.notice = [&](const std::string& notice) {
    const std::lock_guard lock(mutex);
    result.notes.push_back("note: " + notice);
  };
  const bool is_new = !std::filesystem::exists(options.out);
  runlog::make_folder(options.out);
  const auto images = first_images(*settings, options.out, result);
  if (!images) {
    std::error_code ignored;
    if (is_new) std::filesystem::remove(options.out, ignored);  // if it is empty
    return images.error();
  }

  const sim_povray::KeyPlaces places = config::key_places(robot, map);
  const Subject subject{robot, map, places};
  check_start(subject, result);
  check_start_place(subject, world, result);
  std::optional<sim_povray::SceneGeometry> scene;
  if (auto read = sim_povray::SceneGeometry::read(world.place)) {
    scene = *std::move(read);
    result.has_surfaces = true;
    check_floor(subject, *scene, result);
    check_landmarks(subject, *scene, result);
    check_obstacles(subject, *scene, result);
  } else {
    result.notes.push_back("note: the map was not compared with the scene's surfaces, which only POV-Ray knows: " +
                           read.error().message);
  }
  check_images(subject, *images->lower, *images->upper, result);

  const sim_povray::OverheadView view = plan_view(subject, scene ? &*scene : nullptr);
  std::optional<Image> above;
  if (scene) {
    above = scene->overhead(view);
  } else if (auto rendered =
                 sim_povray::render_overhead(*map.scene, map.unit_m, view, world.place.render, map.scene_paths)) {
    above = *std::move(rendered);
  } else {
    result.notes.push_back("note: above.svg shows the map alone: " + rendered.error().message);
  }
  result.files.push_back(options.out / kPlan);
  runlog::write_whole(result.files.back(), draw_above(subject, result, view, above));
  return result;
}

}  // namespace twocone::look
