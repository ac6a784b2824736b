// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/rough_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "apps/calibrate/start.h"
#include "apps/config/to_layers.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/survey/overlay.h"
#include "base/quantile.h"
#include "localisation/map_filter.h"
#include "vision/hue_labels.h"
#include "vision/landmark_search.h"

namespace twocone::survey {
namespace {

using localisation::MapFilter;

// Images in which hues are sought.
constexpr int kHueImages = 40;
// A thing that fewer of the chosen frames show is not surveyed: a few may be of something that passed by.
constexpr std::size_t kLeastSightings = 4;

/// A thing that one frame shows, and the landmark that it is.
struct Tie {
  vision::RoughLandmark thing;
  std::size_t landmark = 0;
};

/// The map of one run, in the world of its start.
struct RunMap {
  std::vector<localisation::FoundLandmark> landmarks;
  std::vector<localisation::Pose> poses;  ///< of the run's chosen frames
  std::vector<std::vector<Tie>> ties;     ///< of the run's chosen frames
  localisation::Pose first;               ///< RoughMap::first
  BodyTwist twist;
};

Result<std::array<cv::Mat, 2>> images_at(const runlog::RunData& run, std::size_t row) {
  const auto files = runlog::images_of(run, row);
  auto lower = runlog::read_rgb(files[0], run.robot.lower.settings);
  if (!lower) return lower.error();
  auto upper = runlog::read_rgb(files[1], run.robot.upper.settings);
  if (!upper) return upper.error();
  return std::array{*lower, *upper};
}

/// The hues that a survey goes by.
struct Hues {
  std::vector<Eigen::Vector3d> colours;  ///< none where bands tell landmarks apart
  std::size_t ignored = 0;               ///< number of hues that were found beside bands
};
Result<Hues> hues_in(const calibrate::ChosenFrames& chosen, const config::Robot& robot) {
  const vision::Rig rig = config::to_rig(robot);
  const vision::LandmarkSearch banded(rig, {}, calibrate::size_of(robot.lower), calibrate::size_of(robot.upper));
  std::set<std::size_t> numbers;
  std::vector<vision::MirrorImage> images;
  for (const std::size_t i : calibrate::chosen_rows(chosen.frames.size(), kHueImages)) {
    const calibrate::ChosenFrames::Frame& frame = chosen.frames[i];
    const auto both = images_at(*frame.run, frame.row);
    if (!both) return both.error();
    for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
      const auto& view = of_view(rig, side).settings();
      images.push_back({(*both)[std::size_t(side)], view.centre_px, view.rim_radius_px});
    }
    for (const vision::RoughLandmark& thing : banded.look((*both)[0], (*both)[1])) numbers.insert(thing.hue);
  }
  Hues hues{vision::find_hues(images)};
  if (numbers.size() >= vision::kBandsAlone) {
    hues.ignored = hues.colours.size();
    hues.colours.clear();
  }
  return hues;
}

/// Returns the pose that lays what a frame shows onto landmarks: least squares of places, the nearer the more weight.
std::optional<Eigen::Vector3d> pose_from(const std::vector<Tie>& ties, const std::vector<Eigen::Vector2d>& places_m) {
  double weights = 0;
  Eigen::Vector2d body = Eigen::Vector2d::Zero();
  Eigen::Vector2d world = Eigen::Vector2d::Zero();
  const auto seen_at = [](const Tie& tie) {
    return Eigen::Vector2d(tie.thing.range_m * std::cos(tie.thing.bearing_rad),
                           tie.thing.range_m * std::sin(tie.thing.bearing_rad));
  };
  const auto weight_of = [](const Tie& tie) { return 1 / (tie.thing.range_m * tie.thing.range_m); };
  if (ties.size() < 2) return std::nullopt;
  for (const Tie& tie : ties) {
    weights += weight_of(tie);
    body += weight_of(tie) * seen_at(tie);
    world += weight_of(tie) * places_m[tie.landmark];
  }
  body /= weights;
  world /= weights;
  double cosine = 0;
  double sine = 0;
  for (const Tie& tie : ties) {
    const Eigen::Vector2d b = seen_at(tie) - body;
    const Eigen::Vector2d w = places_m[tie.landmark] - world;
    cosine += weight_of(tie) * b.dot(w);
    sine += weight_of(tie) * (b.x() * w.y() - b.y() * w.x());
  }
  const double heading_rad = std::atan2(sine, cosine);
  const Eigen::Vector2d place_m = world - Eigen::Rotation2Dd(heading_rad) * body;
  return Eigen::Vector3d(place_m.x(), place_m.y(), heading_rad);
}

/// Maps one run.
Result<RunMap> map_of(const runlog::RunData& run, const calibrate::ChosenFrames& chosen, const config::Robot& robot,
                      const std::vector<Eigen::Vector3d>& colours) {
  const config::BeliefErrors errors = errors_without_landmarks(robot, run.map);
  const vision::Rig rig = config::to_rig(robot);
  const vision::LandmarkSearch search(rig, colours, calibrate::size_of(robot.lower), calibrate::size_of(robot.upper),
                                      errors.vision);
  MapFilter filter(rig, errors.vision, config::to_wheels(robot), {}, errors.wheels, config::to_start_pose(robot));
  RunMap map;
  std::size_t next = 0;
  for (const calibrate::ChosenFrames::Frame& frame : chosen.frames) {
    if (frame.run != &run) continue;
    for (; next <= frame.row && next < run.drive.size(); ++next) {
      filter.predict(run.drive[next].t_s, run.drive[next].left_rad, run.drive[next].right_rad);
    }
    const auto both = images_at(run, frame.row);
    if (!both) return both.error();
    const runlog::FrameRow& stamps = run.frames[frame.row];
    const auto motion = vision::frame_motion(runlog::twist_at(run, frame.row), stamps.upper_t_s - stamps.lower_t_s);
    if (map.poses.empty()) {
      map.first = filter.pose().pose;
      map.twist = motion ? motion->twist : BodyTwist{};
    }
    const auto things = search.look((*both)[0], (*both)[1], motion);
    const auto landmarks = filter.observe(things);
    map.poses.push_back(filter.pose().pose);
    std::vector<Tie>& ties = map.ties.emplace_back();
    for (std::size_t i = 0; i < things.size(); ++i) {
      if (landmarks[i]) ties.push_back({things[i], *landmarks[i]});
    }
  }
  for (std::size_t i = 0; i < filter.size(); ++i) map.landmarks.push_back(filter.landmark(i));
  return map;
}

/// Makes one landmark of those of one hue that are nearer to each other than kTwins_m. The one that was seen most
/// stays.
void merge_twins(RunMap& map) {
  constexpr double kTwins_m = 0.5;
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    for (std::size_t k = 0; k < map.landmarks.size(); ++k) {
      localisation::FoundLandmark& one = map.landmarks[i];
      localisation::FoundLandmark& other = map.landmarks[k];
      if (i == k || one.hue != other.hue || other.sightings == 0 || one.sightings < other.sightings) continue;
      if ((one.numbers - other.numbers).head<2>().norm() > kTwins_m) continue;
      one.sightings += other.sightings;
      other.sightings = 0;
      for (std::vector<Tie>& ties : map.ties) {
        for (Tie& tie : ties) {
          if (tie.landmark == k) tie.landmark = i;
        }
      }
    }
  }
}

/// Returns what a filter found as a landmark, named by its looks alone; without a name if too few frames show it.
Landmark to_landmark(const localisation::FoundLandmark& found, const std::vector<std::vector<Tie>>& ties,
                     std::size_t index, const std::vector<Eigen::Vector3d>& colours) {
  // What hides a part of a landmark makes it thinner, and never thicker.
  constexpr double kWidest = 0.8;
  std::vector<double> radii_m;
  for (const std::vector<Tie>& of_frame : ties) {
    for (const Tie& tie : of_frame) {
      if (tie.landmark == index) radii_m.push_back(tie.thing.radius_m);
    }
  }
  Landmark landmark = vision::looking_like(found.hue, colours);
  landmark.x_m = found.numbers[vision::kPlaceX];
  landmark.y_m = found.numbers[vision::kPlaceY];
  landmark.radius_m = radii_m.empty() ? found.numbers[vision::kRadius] : base::quantile(radii_m, kWidest);
  landmark.top_m = found.numbers[vision::kTop];
  if (found.sightings >= kLeastSightings) landmark.name = vision::looks_of(landmark);
  return landmark;
}

}  // namespace

config::BeliefErrors errors_without_landmarks(const config::Robot& robot, config::Map map) {
  map.landmarks.clear();
  return config::to_belief_errors(robot, map);
}

Result<RoughMap> find_rough_map(const std::vector<runlog::RunData>& runs, const calibrate::ChosenFrames& chosen,
                                const config::Robot& robot) {
  for (const runlog::RunData& run : runs) {
    if (runlog::has_odometry(run)) continue;
    return Error(ErrorCode::kBadData, "{}: the wheels were not recorded, and a survey needs them", run.folder.string());
  }
  const auto hues = hues_in(chosen, robot);
  if (!hues) return hues.error();
  const std::vector<Eigen::Vector3d>& colours = hues->colours;
  RoughMap map;
  if (hues->ignored > 0) {
    map.left_out.push_back(
        fmt::format("what has one of {} vivid colours: bands identify this room's landmarks", hues->ignored));
  }
  std::map<std::string, int> numbers;
  for (const runlog::RunData& run : runs) {
    auto own = map_of(run, chosen, robot, colours);
    if (!own) return own.error();
    merge_twins(*own);
    std::vector<Landmark> landmarks;  // of this run, in its own world; those without a name are left out
    for (std::size_t i = 0; i < own->landmarks.size(); ++i) {
      landmarks.push_back(to_landmark(own->landmarks[i], own->ties, i, colours));
      const localisation::FoundLandmark& found = own->landmarks[i];
      if (found.sightings == 0 || !landmarks.back().name.empty()) continue;
      map.left_out.push_back(fmt::format("{}: something {} at ({:.2f}, {:.2f}) m was seen in {} of {} frames only",
                                         run.folder.string(), vision::looks_of(landmarks.back()), landmarks.back().x_m,
                                         landmarks.back().y_m, found.sightings, own->poses.size()));
    }
    Overlay overlay;
    if (&run == &runs.front()) {
      map.first = own->first;
      map.twist = own->twist;
    } else {
      overlay = best_overlay(landmarks, map.landmarks);
      if (overlay.agree < kLeastShared) {
        return Error(ErrorCode::kBadData, "{}: only {} of its landmarks are those of {}, and a survey of both needs {}",
                     run.folder.string(), overlay.agree, runs.front().folder.string(), kLeastShared);
      }
    }
    std::vector<std::optional<std::size_t>> index_of;
    for (Landmark& landmark : landmarks) {
      index_of.emplace_back();
      if (landmark.name.empty()) continue;
      const Eigen::Vector2d place_m = overlay.moved(vision::place_m(landmark));
      landmark.x_m = place_m.x();
      landmark.y_m = place_m.y();
      index_of.back() = same_landmark(landmark, map.landmarks);
      if (index_of.back()) continue;
      index_of.back() = map.landmarks.size();
      if (!landmark.bands) landmark.name = fmt::format("{}.{}", landmark.name, ++numbers[landmark.name]);
      map.landmarks.push_back(landmark);
    }
    std::vector<Eigen::Vector2d> places_m;
    places_m.reserve(index_of.size());
    for (const auto& index : index_of) {
      places_m.push_back(index ? vision::place_m(map.landmarks[*index]) : Eigen::Vector2d::Zero());
    }
    for (std::size_t i = 0; i < own->poses.size(); ++i) {
      std::erase_if(own->ties[i], [&](const Tie& tie) { return !index_of[tie.landmark]; });
      map.poses.emplace_back(pose_from(own->ties[i], places_m).value_or(overlay.moved(own->poses[i])));
    }
  }
  if (map.landmarks.size() < 2) {
    return Error(
        ErrorCode::kBadData,
        "{}: {} landmarks of a vivid colour or with bands were found in the images, a survey needs two or more",
        runs.front().folder.string(), map.landmarks.size());
  }
  return map;
}

}  // namespace twocone::survey
