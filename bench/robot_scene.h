// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "apps/behaviours/behaviour.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "base/plane.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::bench {

struct ImageSize {
  int width_px = 640, height_px = 480;
  int antialias = 1;  ///< rays per pixel side
};

struct RobotView {
  std::shared_ptr<const sim_povray::ViewTemplate> view_template;
  std::shared_ptr<const sim_povray::NativeView> native;  ///< null: RobotScene::obstacle()
};

/// A robot in its scene, whose images are rendered at poses of the caller's choice, with the views of a run.
class RobotScene {
 public:
  /// Takes some short renderings of POV-Ray, to find the mirrors. @throws config::FileError, std::runtime_error
  RobotScene(const config::Robot& robot, const ImageSize& size);

  /// Those of the lower and the upper camera.
  [[nodiscard]] const std::vector<RobotView>& views() const { return views_; }
  [[nodiscard]] const sim_povray::Povray& povray() const { return *povray_; }
  [[nodiscard]] const config::Map& map() const { return map_; }
  /// Why only POV-Ray renders this scene. Empty: the native renderer knows it.
  [[nodiscard]] const std::string& obstacle() const { return obstacle_; }

  /// Returns a pose between the walls, also where obstacles are.
  Pose2 pose_anywhere(std::mt19937_64& random) const;
  /// Returns a pose between the walls where the robot stands in no obstacle and in no other robot.
  /// @throws std::runtime_error none was found
  Pose2 free_pose(std::mt19937_64& random) const;
  /// Returns RenderJob::pose of a pose.
  [[nodiscard]] std::string text_of(const Pose2& pose) const;
  /// Returns that of a displacement from the start.
  [[nodiscard]] std::string text_of(const sim_povray::FloorMotion& motion) const;

 private:
  RobotView view(const sim_povray::NamedBlock& carrier, const std::string& name, const ImageSize& size);

  config::Map map_;
  sim_povray::PlaceSettings place_;
  sim_povray::Scene scene_;
  behaviours::Arena arena_;  ///< with what else the scene shows
  std::vector<sim_povray::NamedBlock> movers_{};
  std::size_t carrier_ = 0;
  Pose2 start_{};
  std::unique_ptr<sim_povray::Povray> povray_{};
  std::vector<RobotView> views_{};
  std::string obstacle_{};
};

/// Renders a view in the calling thread. @param pose RenderJob::pose
Image rendered(const sim_povray::NativeView& view, const std::string& pose);

}  // namespace twocone::bench
