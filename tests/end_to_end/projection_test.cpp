// SPDX-License-Identifier: Apache-2.0
// Compares the projection that ranging uses with images by POV-Ray. The two share no formula and no code.
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "drivers/sim_povray/scene/scene.h"
#include "vision/hue_labels.h"

namespace twocone {
namespace {

// The requirement is "within 1 pixel". Half of it is the raster of the image, half a pixel to either side of an edge.
constexpr double kWithin_px = 1;
constexpr int kPosesInTests = 6;
// The edge is searched for within this many pixels to either side of the prediction.
constexpr double kSearch_px = 6;
// A narrower foot has no pixel of its own at its edge.
constexpr double kLeastFoot_px = 3;
// Each pose has two tops for each landmark, and this share must be visible: seven of the lab's twelve.
constexpr double kLeastShareOfTops = 7.0 / 12;

int pose_count() {
  const char* wanted = std::getenv("TWOCONE_POSES");
  return wanted ? std::atoi(wanted) : kPosesInTests;
}

double angle_between(double a_rad, double b_rad) {
  return std::abs(std::remainder(a_rad - b_rad, 2 * std::numbers::pi));
}

/// A robot of the repository, and the part of its room in which it is placed. There, only landmarks, or nothing at all,
/// are higher than the mirrors' horizon.
struct ProjectionCase {
  std::string name;
  std::string robot;
  double most_x_m;
  double most_y_m;
  bool sees_feet;  ///< its mirrors show the feet of landmarks
  // The mast, seen from the mirrors' axis.
  double mast_bearing_rad = std::numbers::pi;
  double mast_half_width_rad = 0.004 / 0.13;

  friend void PrintTo(const ProjectionCase& c, std::ostream* out) { *out << c.robot; }
};

struct Sight {
  double bearing_rad;
  double half_width_rad;
  double distance_m;
};

/// The top of a landmark in an image: the bearing of its middle just below the edge, and the radius of the edge there.
struct SeenTop {
  double bearing_rad;
  double radius_px;
};

int label_at(const cv::Mat& labels, const Eigen::Vector2d& p) {
  const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  return cv::Rect({0, 0}, labels.size()).contains(pixel) ? int(labels.at<std::uint8_t>(pixel)) : 0;
}

std::optional<SeenTop> find_top(const cv::Mat& labels, int label, const vision::MirrorView& view, double bearing_rad,
                                double radius_px, double half_width_rad) {
  const Eigen::Vector2d centre = view.settings().centre_px;
  // The middle is between the two sides on a circle well below the top, where the sides are straight.
  const double inside_px = radius_px - kSearch_px;
  double first = NAN;
  double last = NAN;
  const double step_rad = 0.05 / inside_px;
  for (double off = -3 * half_width_rad; off <= 3 * half_width_rad; off += step_rad) {
    if (label_at(labels, centre + view.offset_px(bearing_rad + off, inside_px)) != label) continue;
    if (std::isnan(first)) first = off;
    last = off;
  }
  if (std::isnan(first)) return std::nullopt;
  SeenTop top{bearing_rad + (first + last) / 2, 0};
  for (double r = radius_px + kSearch_px; r > inside_px; r -= 0.05) {
    if (label_at(labels, centre + view.offset_px(bearing_rad, r)) == label) {
      top.radius_px = r;
      return top;
    }
  }
  return std::nullopt;
}

/// Returns the radius of a landmark's foot, which is its innermost pixel.
std::optional<double> find_foot(const cv::Mat& labels, int label, const vision::MirrorView& view, double bearing_rad,
                                double radius_px) {
  for (double r = radius_px - kSearch_px; r < radius_px + kSearch_px; r += 0.05) {
    if (label_at(labels, view.settings().centre_px + view.offset_px(bearing_rad, r)) == label) return r;
  }
  return std::nullopt;
}

class Projection : public testing::TestWithParam<ProjectionCase> {};

/// TWOCONE_ROBOT=FILE adds a robot in a changed copy of the lab, whose `rig:` describes the change.
std::vector<ProjectionCase> cases() {
  std::vector<ProjectionCase> all = {
      {"Lab", "robots/lab_sim.yaml", 2.2, 1.7, false},
      {"Cone120", "robots/mirrors/cone120.yaml", 1.4, 1.0, true},
      {"Hall", "robots/hall_sim.yaml", 2.3, 1.8, false, std::numbers::pi, 0.005 / 0.20},
      {"Workshop", "robots/workshop_sim.yaml", 1.1, 0.65, false, 2.5, 0.003 / 0.10},
  };
  if (const char* file = std::getenv("TWOCONE_ROBOT")) all.push_back({"FromEnvironment", file, 2.2, 1.7, false});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Robots, Projection, testing::ValuesIn(cases()),
                         [](const auto& test) { return test.param.name; });

TEST_P(Projection, AgreesWithPovrayOnEveryVisibleLandmark) {
  const config::Robot robot = config::read_robot(std::filesystem::path(TWOCONE_SOURCE_DIR) / GetParam().robot);
  const config::Map map = config::read_map(robot.map);
  const auto rig = config::to_rig(robot);
  const auto arena = config::to_arena(map);
  std::vector<Eigen::Vector3d> colours;
  for (const Landmark& landmark : map.landmarks) colours.emplace_back(landmark.colour.data());
  const vision::HueLabels hues(colours);

  auto scene = sim_povray::Scene::read(*map.scene);
  ASSERT_TRUE(scene) << scene.error().message;
  const auto body = scene->object("robot");
  ASSERT_TRUE(body) << body.error().message;
  const auto program = sim_povray::find_povray("povray");
  ASSERT_TRUE(program) << program.error().message;
  sim_povray::ProcessRenderer renderer(sim_povray::Povray(*program, *map.scene, std::chrono::minutes(2)), 4);

  std::mt19937_64 random(450);
  std::uniform_real_distribution<double> x(-GetParam().most_x_m, GetParam().most_x_m);
  std::uniform_real_distribution<double> y(-GetParam().most_y_m, GetParam().most_y_m);
  std::uniform_real_distribution<double> heading(-std::numbers::pi, std::numbers::pi);
  std::vector<Pose2> poses;
  while (int(poses.size()) < pose_count()) {
    const Pose2 pose{x(random), y(random), heading(random)};
    if (arena.clearance_m({pose.x_m, pose.y_m}) >= robot.body_radius_m) poses.push_back(pose);
  }

  std::vector<std::array<std::future<ImageResult>, 2>> images;
  for (const Pose2& pose : poses) {
    const auto motion = sim_povray::motion_between({}, pose);
    auto& pair = images.emplace_back();
    for (const auto& [i, name, entry] : {std::tuple{0, "lower", robot.lower}, {1, "upper", robot.upper}}) {
      const auto camera = scene->camera(name);
      ASSERT_TRUE(camera) << camera.error().message;
      auto promise = std::make_shared<std::promise<ImageResult>>();
      pair[std::size_t(i)] = promise->get_future();
      renderer.submit(sim_povray::plain_image(name,
                                              sim_povray::with_pose(scene->view_template({*body}, *camera, ""),
                                                                    scene->pose_text({motion}, motion, map.unit_m)),
                                              entry.settings.width_px, entry.settings.height_px, 1),
                      [promise](ImageResult image) { promise->set_value(std::move(image)); });
    }
  }

  int compared = 0;
  int feet = 0;
  int hidden = 0;
  double worst_px = 0;
  double sum_px = 0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose2& pose = poses[k];
    std::vector<Sight> sights;
    for (const config::Landmark& landmark : map.landmarks) {
      const double dx = landmark.x_m - pose.x_m;
      const double dy = landmark.y_m - pose.y_m;
      const double distance = std::hypot(dx, dy);
      sights.push_back({std::atan2(dy, dx) - pose.heading_rad, std::asin(landmark.radius_m / distance), distance});
    }
    for (std::size_t v = 0; v < 2; ++v) {
      const auto image = images[k][v].get();
      ASSERT_TRUE(image) << image.error().message;
      const cv::Mat labels = hues.label(estimation::as_mat(**image));
      const vision::MirrorView& view = v == 0 ? rig.lower : rig.upper;
      for (std::size_t i = 0; i < sights.size(); ++i) {
        const Sight& sight = sights[i];
        const double near_m = sight.distance_m - map.landmarks[i].radius_m;
        const auto predicted = view.project(
            {near_m * std::cos(sight.bearing_rad), near_m * std::sin(sight.bearing_rad), map.landmarks[i].top_m});
        const auto foot_px = view.image_radius_px(near_m, 0);
        if (!predicted && !foot_px) continue;
        bool covered = angle_between(sight.bearing_rad, GetParam().mast_bearing_rad) <
                       sight.half_width_rad + GetParam().mast_half_width_rad;
        for (std::size_t j = 0; j < sights.size(); ++j) {
          covered = covered || (j != i && sights[j].distance_m < sight.distance_m &&
                                angle_between(sight.bearing_rad, sights[j].bearing_rad) <
                                    sight.half_width_rad + sights[j].half_width_rad);
        }
        if (covered) {
          ++hidden;
          continue;
        }
        const std::string where =
            fmt::format("pose {} ({:.3f} m, {:.3f} m, {:.3f} rad), {} in the {} mirror", k, pose.x_m, pose.y_m,
                        pose.heading_rad, map.landmarks[i].name, v == 0 ? "lower" : "upper");
        if (foot_px && 2 * *foot_px * sight.half_width_rad >= kLeastFoot_px) {
          const auto foot = find_foot(labels, int(i) + 1, view, sight.bearing_rad, *foot_px);
          ASSERT_TRUE(foot) << where << " has no foot in the image";
          EXPECT_NEAR(*foot, *foot_px, kWithin_px) << where;
          worst_px = std::max(worst_px, std::abs(*foot - *foot_px));
          ++feet;
        }
        if (!predicted) continue;  // too near: its top lies beyond the rim
        const Eigen::Vector2d offset = *predicted - view.settings().centre_px;
        const auto top =
            find_top(labels, int(i) + 1, view, view.bearing_rad(offset), offset.norm(), sight.half_width_rad);
        ASSERT_TRUE(top) << where << " is not in the image";
        const Eigen::Vector2d seen = view.settings().centre_px + view.offset_px(top->bearing_rad, top->radius_px);
        const double off_px = (seen - *predicted).norm();
        EXPECT_LE(off_px, kWithin_px) << where;
        worst_px = std::max(worst_px, off_px);
        sum_px += off_px;
        ++compared;
      }
    }
  }
  EXPECT_GE(compared, kLeastShareOfTops * 2 * double(map.landmarks.size() * poses.size())) << "most must be visible";
  EXPECT_GE(feet, GetParam().sees_feet ? 4 * int(poses.size()) : 0) << "the feet of near landmarks must be visible";
  std::printf(
      "%d poses, %d landmark tops and %d feet compared, %d hidden by the mast or another landmark: tops' mean %.3f px, "
      "worst of all %.3f px\n",
      int(poses.size()), compared, feet, hidden, sum_px / compared, worst_px);
}

}  // namespace
}  // namespace twocone
