// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/start_pose.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace twocone::vision::calibration {
namespace {

struct Match {
  std::size_t landmark;
  Eigen::Vector2d body_m;
  Eigen::Vector2d world_m;
};

/// Least-squares rigid motion (Umeyama without scale, in the plane).
Eigen::Vector3d best_pose(const std::vector<const Match*>& matches) {
  Eigen::Vector2d body = Eigen::Vector2d::Zero();
  Eigen::Vector2d world = Eigen::Vector2d::Zero();
  for (const Match* m : matches) {
    body += m->body_m / double(matches.size());
    world += m->world_m / double(matches.size());
  }
  double cosine = 0;
  double sine = 0;
  for (const Match* m : matches) {
    const Eigen::Vector2d b = m->body_m - body;
    const Eigen::Vector2d w = m->world_m - world;
    cosine += b.dot(w);
    sine += b.x() * w.y() - b.y() * w.x();
  }
  const double heading = std::atan2(sine, cosine);
  const Eigen::Vector2d place = world - Eigen::Rotation2Dd(heading) * body;
  return {place.x(), place.y(), heading};
}

std::vector<const Match*> agreeing(const std::vector<Match>& matches, const Eigen::Vector3d& pose) {
  std::vector<const Match*> agree;
  for (const Match& m : matches) {
    const Eigen::Vector2d seen = pose.head<2>() + Eigen::Rotation2Dd(pose.z()) * m.body_m;
    if ((seen - m.world_m).norm() <= kAgree_m) agree.push_back(&m);
  }
  return agree;
}

}  // namespace

std::optional<Eigen::Vector3d> start_pose(const Rig& rig, const std::vector<Landmark>& landmarks,
                                          const CalibrationFrame& frame) {
  std::vector<Match> matches;
  for (const LandmarkSighting& s : frame.sightings) {
    const Landmark& landmark = landmarks[s.landmark];
    const MirrorView& view = s.side == Side::kLower ? rig.lower : rig.upper;
    const auto ray = view.back_project(s.sighting.pixel_px);
    const auto place = ray ? axis_at_height(view, *ray, landmark.radius_m, landmark.top_m) : std::nullopt;
    if (place) matches.push_back({s.landmark, *place, place_m(landmark)});
  }
  std::vector<const Match*> most;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    for (std::size_t j = i + 1; j < matches.size(); ++j) {
      if (matches[i].landmark == matches[j].landmark) continue;
      auto agree = agreeing(matches, best_pose({&matches[i], &matches[j]}));
      if (agree.size() > most.size()) most = std::move(agree);
    }
  }
  if (!show_two_landmarks(most, &Match::landmark)) return std::nullopt;
  return best_pose(most);
}

}  // namespace twocone::vision::calibration
