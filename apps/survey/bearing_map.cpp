// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/bearing_map.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>
#include <Eigen/LU>

#include "apps/calibrate/start.h"
#include "apps/config/to_layers.h"
#include "apps/runlog/storage/image_file.h"
#include "base/plane.h"
#include "base/quantile.h"
#include "localisation/odometry.h"
#include "vision/hue_labels.h"
#include "vision/landmark_search.h"
#include "vision/mirror_search.h"
#include "vision/self_rig.h"

namespace twocone::survey {
namespace {

constexpr int kImagesForMirror = 30;  // in which the mirror is sought
constexpr int kImagesForHues = 40;    // and the hues
// A second region of a colour this large beside the first is a second thing.
constexpr double kSecondThing = 0.3;
constexpr std::size_t kLeastBearings = 8;
// A bearing that is farther off than this is of another thing.
constexpr double kOff_rad = 0.2;
// Directions of the camera that are tried, and that are tried between the best and its neighbours.
constexpr int kDirections = 72;
constexpr int kFineDirections = 20;
// Bearings that the best direction leaves this far off, root mean square, are not explained.
constexpr double kExplained_rad = 0.12;

/// A landmark's colour in one frame.
struct Seen {
  std::size_t frame = 0;
  double angle_rad = 0;  // in the image
  double top_px = 0;
  double area_px = 0;
};

/// A landmark by its bearings.
struct Placed {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  double cost = 0;  // sum of squares of its bearings' errors, each at most that of kOff_rad
};

/// A direction of the camera, and how well it explains all bearings.
struct Direction {
  double azimuth_rad = 0;
  double sign = 1;  // -1: mirrored
  double cost = 0;
};

double bearing_of(const Seen& seen, const Direction& direction) {
  return direction.azimuth_rad + direction.sign * seen.angle_rad;
}

/// Places a landmark where its bearings meet: the point with the least squares of distances to their lines, in three
/// rounds. The later ones weigh each line by its length, and the last one leaves out what was off.
Placed place_of(const std::vector<Seen>& sightings, const std::vector<Pose2>& poses, const Direction& direction) {
  Placed placed;
  std::vector<bool> is_off(sightings.size(), false);
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix2d normal = 1e-9 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < sightings.size(); ++i) {
      if (is_off[i]) continue;
      const Pose2& pose = poses[sightings[i].frame];
      const double world_rad = pose.heading_rad + bearing_of(sightings[i], direction);
      const Eigen::Vector2d across(-std::sin(world_rad), std::cos(world_rad));
      const Eigen::Vector2d from(pose.x_m, pose.y_m);
      // An error of the bearing counts the more, the farther the landmark is.
      const double distance_m = round == 0 ? 1 : std::max(0.3, (placed.place_m - from).norm());
      normal += across * across.transpose() / (distance_m * distance_m);
      right += across * across.dot(from) / (distance_m * distance_m);
    }
    placed.place_m = normal.ldlt().solve(right);
    placed.cost = 0;
    for (std::size_t i = 0; i < sightings.size(); ++i) {
      const Pose2& pose = poses[sightings[i].frame];
      const double there_rad = std::atan2(placed.place_m.y() - pose.y_m, placed.place_m.x() - pose.x_m);
      const double off_rad =
          std::abs(base::wrap_angle_rad(pose.heading_rad + bearing_of(sightings[i], direction) - there_rad));
      is_off[i] = round > 0 && off_rad > kOff_rad;
      placed.cost += std::min(off_rad * off_rad, kOff_rad * kOff_rad);
    }
  }
  return placed;
}

using Tracks = std::vector<std::vector<Seen>>;  // colour by colour

double cost_of(const Tracks& tracks, const std::vector<Pose2>& poses, const Direction& direction) {
  double cost = 0;
  for (const std::vector<Seen>& track : tracks) {
    if (track.size() >= kLeastBearings) cost += place_of(track, poses, direction).cost;
  }
  return cost;
}

Direction best_direction(const Tracks& tracks, const std::vector<Pose2>& poses) {
  constexpr double kStep_rad = 2 * std::numbers::pi / kDirections;
  std::optional<Direction> best;
  const auto attempt = [&](Direction direction) {
    direction.cost = cost_of(tracks, poses, direction);
    if (!best || direction.cost < best->cost) best = direction;
  };
  for (int i = 0; i < kDirections; ++i) {
    for (const double sign : {1.0, -1.0}) attempt({i * kStep_rad, sign});
  }
  const Direction middle = *best;
  for (int i = -kFineDirections; i <= kFineDirections; ++i) {
    attempt({middle.azimuth_rad + i * kStep_rad / kFineDirections, middle.sign});
  }
  return *best;
}

/// Returns the lower view with the mirror where the images show it, if they do.
vision::MirrorView view_from(const std::vector<cv::Mat>& images, const vision::MirrorView& believed) {
  std::vector<cv::Mat> some;
  for (const std::size_t i : calibrate::chosen_rows(images.size(), kImagesForMirror)) some.push_back(images[i]);
  const vision::MirrorSearch found = vision::find_mirror(some);
  if (!found.rim) return believed;
  vision::MirrorViewSettings settings = believed.settings();
  settings.centre_px = found.tip ? found.tip->centre_px : found.rim->centre_px;
  settings.rim_radius_px = found.rim->radius_px;
  return vision::MirrorView(settings);
}

}  // namespace

Result<RoughMap> find_bearing_map(const runlog::RunData& run, const calibrate::ChosenFrames& chosen,
                                  const config::Robot& robot) {
  std::vector<cv::Mat> images;
  RoughMap map;
  std::vector<Pose2> poses;
  localisation::Odometry odometry(config::to_wheels(robot), config::to_start_pose(robot));
  Pose2 pose = config::to_start_pose(robot);
  std::size_t next = 0;
  for (const calibrate::ChosenFrames::Frame& frame : chosen.frames) {
    for (; next <= frame.row && next < run.drive.size(); ++next) {
      pose = odometry.update(run.drive[next].left_rad, run.drive[next].right_rad);
    }
    poses.push_back(pose);
    map.poses.emplace_back(Eigen::Vector3d(pose.x_m, pose.y_m, pose.heading_rad));
    auto image = runlog::read_rgb(runlog::images_of(run, frame.row)[0], robot.lower.settings);
    if (!image) return image.error();
    images.push_back(*std::move(image));
  }
  if (images.empty()) return Error(ErrorCode::kBadData, "{}: there are no frames", run.folder.string());
  map.first = poses.front();
  map.twist = runlog::twist_at(run, chosen.frames.front().row).value_or(BodyTwist{});

  const vision::MirrorView view = view_from(images, config::to_assumed_rig(robot).lower);
  const vision::RimCircle circle{view.settings().centre_px, view.settings().rim_radius_px, 0};
  std::vector<vision::MirrorImage> mirrors;
  for (const std::size_t i : calibrate::chosen_rows(images.size(), kImagesForHues)) {
    mirrors.push_back({images[i], circle.centre_px, circle.radius_px});
  }
  const std::vector<Eigen::Vector3d> colours = vision::find_hues(mirrors);
  const vision::ColourTable table(colours);
  Tracks tracks(colours.size());
  std::vector<std::size_t> doubles(colours.size(), 0);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto seen = vision::sight_by_colour(images[i], circle, view, table, colours.size());
    for (std::size_t hue = 0; hue < colours.size(); ++hue) {
      std::vector<vision::ColourSighting> of;
      std::ranges::copy_if(seen, std::back_inserter(of), [&](const auto& s) { return s.landmark == hue; });
      if (of.empty() || of[0].at_rim) continue;
      if (of.size() > 1 && of[1].area_px > kSecondThing * of[0].area_px) {
        ++doubles[hue];
        continue;
      }
      tracks[hue].push_back({i, of[0].angle_rad, of[0].top_px, of[0].area_px});
    }
  }
  for (std::size_t hue = 0; hue < colours.size(); ++hue) {
    if (doubles[hue] > tracks[hue].size()) tracks[hue].clear();
  }

  const Direction direction = best_direction(tracks, poses);
  std::size_t sightings = 0;
  for (std::size_t hue = 0; hue < colours.size(); ++hue) {
    const std::vector<Seen>& track = tracks[hue];
    if (track.size() < kLeastBearings) continue;
    const Placed placed = place_of(track, poses, direction);
    sightings += track.size();
    if (placed.cost > double(track.size()) * kOff_rad * kOff_rad / 2) continue;  // it moves, or is several things
    std::vector<double> tops_m;
    std::vector<double> radii_m;
    for (const Seen& seen : track) {
      const Pose2& from = poses[seen.frame];
      const double distance_m = std::hypot(placed.place_m.x() - from.x_m, placed.place_m.y() - from.y_m);
      const auto pixel = view.distort_px(view.settings().centre_px + Eigen::Vector2d(seen.top_px, 0));
      const auto ray = pixel ? view.back_project(*pixel, vision::Rim::kGoesOn) : std::nullopt;
      if (!ray) continue;
      const double level = ray->direction.head<2>().norm();
      tops_m.push_back(ray->origin_m.z() + (distance_m - ray->origin_m.head<2>().norm()) * ray->direction.z() / level);
      radii_m.push_back(distance_m * std::sin(std::min(1.0, seen.area_px / (seen.top_px * seen.top_px))));
    }
    if (tops_m.empty()) continue;
    const Eigen::Vector3d& c = colours[hue];
    map.landmarks.push_back({.name = fmt::format("{}.1", vision::hue_name({c.x(), c.y(), c.z()})),
                             .colour = {c.x(), c.y(), c.z()},
                             .x_m = placed.place_m.x(),
                             .y_m = placed.place_m.y(),
                             .radius_m = std::max(0.01, base::median(radii_m)),
                             .top_m = base::median(tops_m)});
  }
  if (map.landmarks.size() < vision::kLeastRigLandmarks) {
    return Error(ErrorCode::kBadData,
                 "{}: a rig that is not known needs {} landmarks of a hue of their own for a start, and {} were found: "
                 "calibrate the robot in a room with a map, or add landmarks",
                 run.folder.string(), vision::kLeastRigLandmarks, map.landmarks.size());
  }
  if (direction.cost > double(sightings) * kExplained_rad * kExplained_rad) {
    return Error(
        ErrorCode::kBadData,
        "{}: the bearings of the landmarks in the lower view do not fit the wheels' way: are the wheels' sizes "
        "and the order of left and right those of the robot file?",
        run.folder.string());
  }
  return map;
}

}  // namespace twocone::survey
