// SPDX-License-Identifier: Apache-2.0
#include "bench/robot_scene.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/scene_views.h"
#include "drivers/sim_povray/world/motion.h"
#include "tests/support/value.h"

namespace twocone::bench {
namespace {

using sim_povray::FloorMotion;
using sim_povray::kPlainQuality;
using sim_povray::motion_between;
using sim_povray::MovingThing;
using sim_povray::NamedBlock;
using sim_povray::NativeView;
using sim_povray::parse_poses;
using sim_povray::Povray;
using sim_povray::Scene;
using sim_povray::SceneAccess;
using sim_povray::ShownCamera;
using sim_povray::ViewTemplate;
using twocone::testing_support::value;

constexpr double kBody_m = 0.3;

}  // namespace

RobotScene::RobotScene(const config::Robot& robot, const ImageSize& size)
    : map_(config::read_map(robot.map)),
      place_(config::to_place(map_)),
      scene_(value(Scene::read(place_.scene))),
      arena_(config::to_arena(map_)) {
  const NamedBlock carrier = value(scene_.robot(robot.name));
  for (const std::string& name : scene_.names()) {
    if (name != "robot" && !name.starts_with("robot.") && !name.starts_with("moving.")) continue;
    if (name == carrier.name) {
      carrier_ = movers_.size();
    } else if (name.starts_with("robot.")) {
      const ShownCamera other = value(shown_camera(place_, name.substr(6), "lower", {}));
      arena_.discs.push_back({{other.x_m, other.y_m}, kBody_m});
    }
    movers_.push_back(value(scene_.object(name)));
  }
  for (const MovingThing& thing : place_.moving) {
    arena_.discs.push_back({thing.path_m.front(), thing.radius_m});
  }
  start_ = config::to_start_pose(robot);
  povray_ = std::make_unique<Povray>(value(confined_povray(place_, scene_)));
  for (const char* const camera : {"lower", "upper"}) views_.push_back(view(carrier, camera, size));
}

Pose2 RobotScene::pose_anywhere(std::mt19937_64& random) const {
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const config::Bounds& b = map_.bounds;
  if (b.max_x_m - b.min_x_m <= 2 * kBody_m || b.max_y_m - b.min_y_m <= 2 * kBody_m) {
    throw std::runtime_error(fmt::format("{}: its bounds are too narrow for a robot", map_.file.string()));
  }
  return {between(b.min_x_m + kBody_m, b.max_x_m - kBody_m), between(b.min_y_m + kBody_m, b.max_y_m - kBody_m),
          between(-M_PI, M_PI)};
}

Pose2 RobotScene::free_pose(std::mt19937_64& random) const {
  constexpr int kMostTries = 10'000;
  for (int i = 0; i < kMostTries; ++i) {
    const Pose2 there = pose_anywhere(random);
    if (arena_.clearance_m({there.x_m, there.y_m}) >= kBody_m) return there;
  }
  throw std::runtime_error(fmt::format("{}: no place of its floor is free for a robot", map_.file.string()));
}

std::string RobotScene::text_of(const Pose2& pose) const { return text_of(motion_between(start_, pose)); }

std::string RobotScene::text_of(const FloorMotion& motion) const {
  std::vector<FloorMotion> motions(movers_.size());
  motions[carrier_] = motion;
  return scene_.pose_text(motions, motion, map_.unit_m);
}

RobotView RobotScene::view(const NamedBlock& carrier, const std::string& name, const ImageSize& size) {
  const NamedBlock camera = value(scene_.camera_of(carrier, name));
  const auto sight = value(find_mirror(*povray_, scene_, carrier, camera, size.width_px, size.height_px, -1));
  ViewTemplate view_template = scene_.view_template(movers_, camera, sight ? sight->mask : "");
  if (sight) view_template.window = sight->window;
  view_template.carrier = int(carrier_);
  view_template.width_px = size.width_px;
  view_template.height_px = size.height_px;
  view_template.antialias = size.antialias;
  view_template.unit_m = place_.unit_m;
  view_template.quality = kPlainQuality;
  SceneAccess access(place_.scene, place_.scene_paths);
  auto native = NativeView::make(view_template, scene_.path(), include_reader(access));
  if (!native) obstacle_ = native.error().message;
  return {std::make_shared<const ViewTemplate>(view_template), native ? *native : nullptr};
}

Image rendered(const NativeView& view, const std::string& pose) {
  const auto poses = parse_poses(pose);
  Image image{view.width_px(), view.height_px(), PixelFormat::kRgb8,
              Bytes(std::vector<std::uint8_t>(3 * std::size_t(view.width_px()) * std::size_t(view.height_px())))};
  const NativeView::Moment moment = view.at(*poses);
  for (int band = 0; band < view.bands(); ++band) view.render(moment, band, image);
  return image;
}

}  // namespace twocone::bench
