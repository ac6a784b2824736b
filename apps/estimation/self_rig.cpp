// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/self_rig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"

namespace twocone::estimation {
namespace {

using vision::MirrorVerdict;
using vision::NotFound;
using vision::Side;

constexpr std::array<const char*, 2> kCameraNames{"lower", "upper"};

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

bool is_missing(const config::Rig& rig, const std::string& key) {
  return std::ranges::find(rig.missing, key) != rig.missing.end();
}

std::string mirror_line(const vision::SelfView& view, const char* camera) {
  const vision::MirrorSearch& mirror = view.mirror;
  std::string line = fmt::format("camera {}: ", camera);
  if (mirror.rim) {
    line += fmt::format("rim ({:.1f}, {:.1f}) +- {:.1f}, radius {:.1f} +- {:.1f} px, {:.0f} % of it seen",
                        mirror.rim->centre_px.x(), mirror.rim->centre_px.y(), mirror.rim->sigma_centre_px,
                        mirror.rim->radius_px, mirror.rim->sigma_radius_px, 100 * mirror.rim->support);
  } else if (view.circle) {
    line += fmt::format("no rim is seen; the landmarks' ranges need radius {:.1f} +- {:.1f} px", view.circle->radius_px,
                        view.circle->sigma_radius_px);
  } else {
    line += fmt::format("no mirror ({})", to_string(mirror.verdict));
  }
  if (mirror.tip) {
    line += fmt::format("; tip ({:.1f}, {:.1f}) +- {:.1f} px", mirror.tip->centre_px.x(), mirror.tip->centre_px.y(),
                        mirror.tip->sigma_px);
  }
  return line;
}

std::string angle_line(const vision::FoundAngle& angle, const char* what) {
  if (!angle.rad) return fmt::format("{}: not found ({})", what, to_string(angle.reason));
  return fmt::format("{}: {:.1f} +- {:.1f} degrees", what, degrees(*angle.rad), degrees(angle.sigma_rad));
}

}  // namespace

vision::SelfRigProblem self_rig_problem(const config::Robot& robot, const config::Map& map) {
  const config::Rig& rig = robot.rig;
  const bool has_circles =
      std::ranges::none_of(rig.missing, [](const std::string& key) { return key.ends_with("_px"); });
  return {.rig = config::to_assumed_rig(robot),
          .has_believed_circles = has_circles,
          .landmarks = config::to_targets(map),
          .frames = {}};
}

SelfRigAnswer compare_with_file(const config::Robot& robot, const vision::SelfRig& found,
                                const vision::SelfRigProblem& problem, Replace which) {
  const vision::Rig rig = vision::to_rig(found, problem);
  SelfRigAnswer answer{robot.rig, {}};
  config::RigSigma sigma = robot.rig.sigma.value_or(config::ruler_sigma(robot.rig));
  // One sigma counts for both views: the wider one.
  config::RigSigma replaced{};
  const bool exchanged = *found.exchanged.value;
  if (exchanged) {  // a lens belongs to its camera
    std::swap(answer.rig.lower.distortion, answer.rig.upper.distortion);
    std::swap(answer.rig.lower.distortion_focal_px, answer.rig.upper.distortion_focal_px);
    std::swap(answer.rig.lower.distortion_principal_px, answer.rig.upper.distortion_principal_px);
    std::swap(answer.rig.lower.camera_info, answer.rig.upper.camera_info);
  }
  const auto seen_in = [&](Side side) -> const vision::SelfView& {
    return found.views[std::size_t(side) ^ std::size_t(exchanged)];
  };
  for (const Side side : {Side::kLower, Side::kUpper}) {
    const char* const name = kCameraNames[std::size_t(side)];
    const vision::MirrorViewSettings& seen = of_view(rig, side).settings();
    const vision::SelfView& view = seen_in(side);
    config::RigView& file = of_view(answer.rig, side);
    const auto add = [&](const char* key, const std::string& in_file, const std::string& text) {
      const std::string full = fmt::format("{}.{}", name, key);
      answer.differences.push_back({full, is_missing(robot.rig, full) ? "" : in_file, text});
    };
    const auto differs = [&](const char* key, double off, double least, double its_sigma) {
      return which == Replace::kAll || is_missing(robot.rig, fmt::format("{}.{}", name, key)) ||
             off > std::max(least, kSameSigmas * its_sigma);
    };
    const Eigen::Vector2d centre(file.centre_px[0], file.centre_px[1]);
    // The rig's rim is that of the image without distortion, the images show another. A lens with the coefficient k1
    // makes a circle's radius r greater by k1 r^3 / v^2, and takes its centre, to first order, away from the lens's
    // axis by 3 k1 r^2 / v^2 times their distance.
    const double bent_share = sigma.distortion * std::pow(seen.rim_radius_px / of_view(rig, side).focal_length_px(), 2);
    const Eigen::Vector2d axis_px =
        seen.distortion ? seen.distortion->principal_px : seen.lens_axis_px.value_or(seen.centre_px);
    const double sigma_centre_px = std::hypot(view.sigma_centre_px, 3 * bent_share * (seen.centre_px - axis_px).norm());
    if (differs("centre_px", (seen.centre_px - centre).norm(), kSameCentre_px, sigma_centre_px)) {
      add("centre_px", fmt::format("({:.1f}, {:.1f})", centre.x(), centre.y()),
          fmt::format("({:.1f}, {:.1f}) px", seen.centre_px.x(), seen.centre_px.y()));
      file.centre_px = {seen.centre_px.x(), seen.centre_px.y()};
      replaced.centre_px = std::max(replaced.centre_px, sigma_centre_px);
    }
    const double sigma_rim_px = std::hypot(view.circle->sigma_radius_px, bent_share * seen.rim_radius_px);
    if (differs("rim_radius_px", std::abs(seen.rim_radius_px - file.rim_radius_px),
                kSameRadiusShare * seen.rim_radius_px, sigma_rim_px)) {
      add("rim_radius_px", fmt::format("{:.1f}", file.rim_radius_px), fmt::format("{:.1f} px", seen.rim_radius_px));
      file.rim_radius_px = seen.rim_radius_px;
      replaced.rim_radius_px = std::max(replaced.rim_radius_px, sigma_rim_px);
    }
    if (seen.mirrored != file.mirrored) {
      add("mirrored", fmt::format("{}", file.mirrored), fmt::format("{}", seen.mirrored));
      file.mirrored = seen.mirrored;
    }
  }
  // A sigma of tilts counts for both views, so that both are replaced if one is.
  const auto is_tilted = [&](Side side) {
    const Eigen::Vector2d in_file(of_view(answer.rig, side).tilt_rad.data());
    const double limit_rad = std::max(kSameTilt_rad, kSameSigmas * seen_in(side).sigma_tilt_rad);
    return (*seen_in(side).tilt_rad - in_file).norm() > limit_rad;
  };
  const bool have_tilts = seen_in(Side::kLower).tilt_rad && seen_in(Side::kUpper).tilt_rad;
  if (have_tilts && (is_tilted(Side::kLower) || is_tilted(Side::kUpper))) {
    for (const Side side : {Side::kLower, Side::kUpper}) {
      auto& tilt_rad = of_view(answer.rig, side).tilt_rad;
      const Eigen::Vector2d& seen_rad = *seen_in(side).tilt_rad;
      answer.differences.push_back(
          {fmt::format("{}.tilt_rad", kCameraNames[std::size_t(side)]),
           fmt::format("({:.1f}, {:.1f})", degrees(tilt_rad[0]), degrees(tilt_rad[1])),
           fmt::format("({:.1f}, {:.1f}) degrees", degrees(seen_rad.x()), degrees(seen_rad.y()))});
      tilt_rad = {seen_rad.x(), seen_rad.y()};
      replaced.tilt_rad = std::max(replaced.tilt_rad, seen_in(side).sigma_tilt_rad);
    }
  }
  // The body's direction is that of the lower view; where it is not found, the file's holds, and the upper view's
  // azimuth is relative to it.
  double lower_rad = robot.rig.lower.azimuth_rad;
  const auto take = [&](const char* key, double in_file_rad, double seen_rad, double sigma_rad, double& value_rad) {
    const bool is_absent = is_missing(robot.rig, key);
    const double off_rad = std::abs(base::wrap_angle_rad(seen_rad - in_file_rad));
    const bool is_same = off_rad <= std::max(kSameAzimuth_rad, kSameSigmas * sigma_rad);
    if (which != Replace::kAll && !is_absent && is_same) return;
    answer.differences.push_back({key, is_absent ? "" : fmt::format("{:.1f}", degrees(in_file_rad)),
                                  fmt::format("{:.1f} degrees", degrees(seen_rad))});
    value_rad = seen_rad;
    replaced.azimuth_rad = std::max(replaced.azimuth_rad, sigma_rad);
  };
  const double kept_rad = lower_rad;
  if (found.azimuth.rad) {
    take("lower.azimuth_rad", kept_rad, *found.azimuth.rad, found.azimuth.sigma_rad, lower_rad);
  } else if (is_missing(robot.rig, "lower.azimuth_rad")) {
    take("lower.azimuth_rad", kept_rad, 0, sigma.azimuth_rad, lower_rad);
  }
  answer.rig.lower.azimuth_rad = lower_rad;
  take("upper.azimuth_rad", robot.rig.upper.azimuth_rad, base::wrap_angle_rad(lower_rad + *found.relative_azimuth.rad),
       found.relative_azimuth.sigma_rad, answer.rig.upper.azimuth_rad);
  answer.rig.missing.clear();
  if (answer.differences.empty()) return answer;
  const auto set = [](double& file, double seen) {
    if (seen > 0) file = std::max(seen, file > 0 ? std::min(file, seen) : 0.0);
  };
  set(sigma.centre_px, replaced.centre_px);
  set(sigma.rim_radius_px, replaced.rim_radius_px);
  set(sigma.azimuth_rad, replaced.azimuth_rad);
  set(sigma.tilt_rad, replaced.tilt_rad);
  answer.rig.sigma = sigma;
  return answer;
}

std::vector<config::KeyChange> changes_to(const SelfRigAnswer& answer) {
  std::vector<config::KeyChange> changes;
  for (const RigDifference& difference : answer.differences) {
    const bool is_lower = difference.key.starts_with("lower.");
    const config::RigView& view = is_lower ? answer.rig.lower : answer.rig.upper;
    const std::string key = difference.key.substr(difference.key.find('.') + 1);
    std::string value;
    if (key == "centre_px") value = fmt::format("[{}, {}]", view.centre_px[0], view.centre_px[1]);
    if (key == "rim_radius_px") value = fmt::format("{}", view.rim_radius_px);
    if (key == "tilt_rad") value = fmt::format("[{}, {}]", view.tilt_rad[0], view.tilt_rad[1]);
    if (key == "azimuth_rad") value = fmt::format("{}", view.azimuth_rad);
    if (key == "mirrored") value = fmt::format("{}", view.mirrored);
    changes.push_back({fmt::format("rig.{}", difference.key), value});
  }
  if (changes.empty() || !answer.rig.sigma) return changes;
  // The covariance of a calibration is that of the numbers which are replaced.
  if (!answer.rig.calibration.empty()) changes.push_back({"rig.calibration", "none"});
  changes.push_back(config::change_to(*answer.rig.sigma));
  return changes;
}

std::vector<std::string> lines_of(const vision::SelfRig& found) {
  std::vector<std::string> lines;
  for (const std::size_t i : {0, 1}) lines.push_back(mirror_line(found.views[i], kCameraNames[i]));
  if (found.shows_one_mirror) {
    lines.emplace_back("both cameras show the same mirror");
  } else if (found.exchanged.value) {
    lines.push_back(*found.exchanged.value
                        ? "exchanged: camera lower shows the upper mirror, and camera upper the lower one"
                        : "cameras: each shows its own mirror, they are not exchanged");
  } else {
    lines.push_back(fmt::format("exchanged: not found ({})", to_string(found.exchanged.reason)));
  }
  for (const std::size_t i : {0, 1}) {
    const vision::Decision& mirrored = found.views[i].mirrored;
    lines.push_back(mirrored.value
                        ? fmt::format("camera {}: the image is {}mirrored; {} sightings of {} landmarks fit the map",
                                      kCameraNames[i], *mirrored.value ? "" : "not ", found.views[i].fitted,
                                      found.views[i].landmarks)
                        : fmt::format("camera {}: mirrored: not found ({}); {} landmarks", kCameraNames[i],
                                      to_string(mirrored.reason), found.views[i].landmarks));
  }
  lines.push_back(angle_line(found.relative_azimuth, "azimuth of the upper view minus the lower view's"));
  lines.push_back(angle_line(found.azimuth, "azimuth of the lower view"));
  return lines;
}

std::string what_to_change(MirrorVerdict verdict, const std::string& camera) {
  switch (verdict) {
    case MirrorVerdict::kDark:
      return fmt::format(
          "the images of camera {} are dark: take off the lens cap, or add light; if they stay dark, the camera or its "
          "cable is dead",
          camera);
    case MirrorVerdict::kEven:
      return fmt::format(
          "the images of camera {} show nothing, only one brightness: uncover and focus the lens, use a shorter "
          "exposure; if it stays so, the camera is dead",
          camera);
    case MirrorVerdict::kNoCircle:
    case MirrorVerdict::kNoMirror:
    case MirrorVerdict::kFound:
      break;
  }
  return fmt::format(
      "the images of camera {} show something else than a mirror: no circle with upright edges that point at its "
      "middle; turn the camera to the mirror until most of the rim is in the image",
      camera);
}

std::string what_to_change(const vision::SelfRig& found) {
  if (found.shows_one_mirror) {
    return "both cameras show the same mirror: do cameras.lower and cameras.upper name two devices (twocone devices)?";
  }
  for (const std::size_t i : {0, 1}) {
    if (found.views[i].is_blind()) return what_to_change(found.views[i].mirror.verdict, kCameraNames[i]);
  }
  for (const std::size_t i : {0, 1}) {
    const vision::SelfView& view = found.views[i];
    // Without a rim, colours within the circle that the file believes are no evidence of a mirror.
    const bool fits_map =
        view.mirrored.reason != NotFound::kNoLandmarks && view.mirrored.reason != NotFound::kNotTheMap;
    if (view.mirror.verdict != MirrorVerdict::kFound && !fits_map) {
      return what_to_change(view.mirror.verdict, kCameraNames[i]) +
             "; within the circle that the robot file states, no landmarks stand as the map says";
    }
    if (view.mirrored.reason == NotFound::kNoLandmarks || view.landmarks < 3) {
      return fmt::format(
          "camera {} sees the colours of {} of the map's landmarks, and 3 are needed: is this the map of this room? "
          "Add "
          "light, switch automatic white balance off, and compare the map's colours with the images",
          kCameraNames[i], view.landmarks);
    }
    if (view.mirrored.reason == NotFound::kNotTheMap) {
      return fmt::format(
          "the landmarks that camera {} sees do not stand as the map says, nor mirrored: do the map's places, tops and "
          "colours belong to this room, and rig.lens_height_m, mirror_separation_m and lens_to_tip_m to this robot?",
          kCameraNames[i]);
    }
  }
  // The colours of something else were taken for landmarks, within the circle that the file believes.
  for (const std::size_t i : {0, 1}) {
    const MirrorVerdict verdict = found.views[i].mirror.verdict;
    if (verdict != MirrorVerdict::kFound) return what_to_change(verdict, kCameraNames[i]);
  }
  if (!found.exchanged.value) {
    return "the images do not show which camera looks into the upper mirror: both cameras must see the same landmarks, "
           "and rig.mirror_separation_m and the map's top_m must be right";
  }
  for (const std::size_t i : {0, 1}) {
    if (!found.views[i].mirrored.value) {
      return fmt::format(
          "the images of camera {} do not show whether they are mirrored: move the robot to where both cameras see "
          "four "
          "landmarks or more, or drive a curve",
          kCameraNames[i]);
    }
  }
  return fmt::format(
      "the two cameras' images do not show how camera {} is turned against camera {}: move the robot to where both see "
      "three landmarks or more",
      kCameraNames[1], kCameraNames[0]);
}

}  // namespace twocone::estimation
