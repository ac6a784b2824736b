// SPDX-License-Identifier: Apache-2.0
#include "apps/telemetry/telemetry.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/tables/tables.h"
#include "vision/scan.h"
#include "vision/srgb.h"

namespace twocone::telemetry {
namespace {

using Json = nlohmann::ordered_json;

/// The grid of a panorama: fine enough that a straight line between its points is within 0.1 px of the mirror's image.
constexpr int kBearings = 121;
constexpr int kRadii = 9;

double rounded(double value, double step) { return std::round(value / step) * step; }

/// Returns a place in an image to a hundredth of a pixel: more digits show nothing, and cost half of a page.
Json pixel_of(const Eigen::Vector2d& px) {
  constexpr double kStep_px = 0.01;
  return {rounded(px.x(), kStep_px), rounded(px.y(), kStep_px)};
}

Json pose_of(const runlog::PoseRow& pose) {
  return {{"x_m", pose.x_m}, {"y_m", pose.y_m}, {"heading_rad", pose.heading_rad}};
}

Json unroll_of(const vision::MirrorView& view) {
  const vision::MirrorViewSettings& settings = view.settings();
  Json pixels = Json::array();
  for (int row = 0; row < kRadii; ++row) {
    // The tip itself has no bearing.
    const double radius_px = std::max(settings.rim_radius_px * (1 - double(row) / (kRadii - 1)), 1e-3);
    for (int column = 0; column < kBearings; ++column) {
      const double bearing_rad = std::numbers::pi * (1 - 2 * double(column) / (kBearings - 1));
      const auto px = view.distort_px(settings.centre_px + view.offset_px(bearing_rad, radius_px));
      pixels.push_back(px ? pixel_of(*px) : Json());
    }
  }
  return {{"bearings", kBearings}, {"radii", kRadii}, {"pixels_px", std::move(pixels)}};
}

Json view_of(const vision::MirrorView& view, const CameraSettings& camera) {
  const vision::MirrorViewSettings& settings = view.settings();
  return {{"width_px", camera.width_px},
          {"height_px", camera.height_px},
          {"centre_px", pixel_of(settings.centre_px)},
          {"rim_radius_px", settings.rim_radius_px},
          {"unroll", unroll_of(view)}};
}

Json landmark_of(const Landmark& landmark) {
  Json json{{"name", landmark.name},
            {"x_m", landmark.x_m},
            {"y_m", landmark.y_m},
            {"radius_m", landmark.radius_m},
            {"top_m", landmark.top_m}};
  if (landmark.bands) {
    json["bands"] = landmark.bands->number;
  } else {
    Json rgb = Json::array();
    for (const double light : landmark.colour) rgb.push_back(std::lround(vision::linear_to_srgb(light)));
    json["rgb"] = std::move(rgb);
  }
  return json;
}

Json obstacle_of(const config::Obstacle& obstacle) {
  if (const auto* const disc = std::get_if<Disc>(&obstacle)) {
    return {{"x_m", disc->centre.x_m}, {"y_m", disc->centre.y_m}, {"radius_m", disc->radius_m}};
  }
  Json outline = Json::array();
  for (const config::Point& p : std::get<config::Polygon>(obstacle)) outline.push_back({p.x_m, p.y_m});
  return {{"outline_m", std::move(outline)}};
}

/// Returns the row of a table inside the line of its frame.
template <typename Row>
Json row_of(const Row& row) {
  Json object = runlog::to_object(row);
  object.erase("frame");
  object.erase("t_s");
  return object;
}

template <typename Row>
Json rows_of(const std::vector<Row>& rows) {
  Json array = Json::array();
  for (const Row& row : rows) array.push_back(row_of(row));
  return array;
}

Json scan_of(const std::vector<vision::Beam>& scan) {
  Json ranges_m = Json::array();
  std::string states;
  for (const vision::Beam& beam : scan) {
    states += to_string(beam.state).front();
    ranges_m.push_back(beam.state == vision::BeamState::kUnknown ? Json()
                                                                 : Json(std::round(1000 * beam.range_m) / 1000));
  }
  return {{"states", states}, {"ranges_m", std::move(ranges_m)}};
}

}  // namespace

Json map_of(const config::Map& map) {
  Json landmarks = Json::array(), obstacles = Json::array();
  for (const Landmark& landmark : map.landmarks) landmarks.push_back(landmark_of(landmark));
  for (const config::Obstacle& obstacle : map.obstacles) obstacles.push_back(obstacle_of(obstacle));
  const Bounds& b = map.bounds;
  return {{"bounds_m", {b.min_x_m, b.min_y_m, b.max_x_m, b.max_y_m}},
          {"landmarks", std::move(landmarks)},
          {"obstacles", std::move(obstacles)}};
}

std::vector<Eigen::Vector2d> outline_px(const vision::MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m,
                                        double top_m) {
  // A lens bends a side by less than a pixel over its whole length.
  constexpr int kSideSteps = 4, kRimSteps = 12;
  const Eigen::Vector2d outwards = p_BL_m - view.settings().axis_offset_m;
  const double distance_m = outwards.norm();
  std::vector<Eigen::Vector2d> outline;
  if (!(distance_m > radius_m)) return outline;
  // A plane through the view's axis touches the cylinder at this angle from the nearest line of its surface.
  const double side_rad = std::acos(radius_m / distance_m);
  const double towards_rad = std::atan2(-outwards.y(), -outwards.x());
  const auto add = [&](double turn, double height_m) {
    const double angle_rad = towards_rad - turn * side_rad;
    const Eigen::Vector2d p = p_BL_m + radius_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    if (const auto px = view.project({p.x(), p.y(), height_m})) outline.push_back(*px);
  };
  for (int i = 0; i < kSideSteps; ++i) add(-1, top_m * i / kSideSteps);
  for (int i = 0; i <= kRimSteps; ++i) add(2.0 * i / kRimSteps - 1, top_m);
  for (int i = kSideSteps - 1; i >= 0; --i) add(1, top_m * i / kSideSteps);
  return outline;
}

Sensors sensors_of(const config::Robot& robot, bool maps) {
  const bool is_simulated = config::is_simulated(robot);
  return {.truth = is_simulated, .fixes = !maps, .skew = !is_simulated};
}

Lines::Lines(const config::Robot& robot, const config::Map& map) : robot_(robot), map_(map) {
  try {
    rig_ = config::to_rig(robot);
  } catch (const config::FileError&) {  // only the outlines and panoramas are lost
  }
}

Json Lines::run(const std::string& name, const runlog::RunInfo& info, const Sensors& sensors) const {
  Json json{{"type", "run"},
            {"schema", kSchema},
            {"version", info.version},
            {"commit", info.commit},
            {"name", name},
            {"behaviour", info.behaviour},
            {"method", info.method},
            {"seed", info.seed},
            {"frames_wanted", info.frames_wanted},
            {"real_time", info.real_time || info.capture.has_value()},
            {"robot",
             {{"name", robot_.name},
              {"body_radius_m", robot_.body_radius_m},
              {"wheel_separation_m", robot_.drive.wheel_separation_m},
              {"wheel_radius_m", robot_.drive.wheel_radius_m},
              {"max_speed_mps", robot_.drive.max_speed_mps},
              {"command_timeout_s", robot_.drive.command_timeout_s},
              {"rate_hz", robot_.lower.settings.rate_hz},
              {"latency_frames", robot_.latency_frames}}},
            {"sensors",
             {{"images", sensors.images},
              {"odometry", sensors.odometry},
              {"truth", sensors.truth},
              {"fixes", sensors.fixes},
              {"skew", sensors.skew}}},
            {"map", map_of(map_)}};
  if (robot_.start) {
    json["start"] = {
        {"x_m", robot_.start->x_m}, {"y_m", robot_.start->y_m}, {"heading_rad", robot_.start->heading_rad}};
  }
  if (rig_) {
    json["views"] = {{"lower", view_of(rig_->lower, robot_.lower.settings)},
                     {"upper", view_of(rig_->upper, robot_.upper.settings)}};
  }
  return json;
}

Json Lines::frame(const runlog::FrameRecord& record) const {
  Json json{{"type", "frame"}};
  json.update(runlog::to_object(record.frame));
  json["drive"] = row_of(record.drive);
  json["odometry"] = pose_of(record.odometry);
  if (record.truth) json["truth"] = pose_of(*record.truth);
  const runlog::AnswerRows& answer = record.answer;
  if (answer.track) json["track"] = row_of(*answer.track);
  json["fixes"] = rows_of(answer.fixes);
  json["ranges"] = rows_of(answer.ranges);
  json["sightings"] = rows_of(answer.sightings);
  if (!answer.landmarks.empty()) json["landmarks"] = rows_of(answer.landmarks);
  if (answer.timing) json["timing"] = row_of(*answer.timing);
  if (!record.scan.empty()) json["scan"] = scan_of(record.scan);
  if (!rig_) return json;
  Json outlines = Json::array();
  for (const runlog::RangeRow& range : answer.ranges) {
    const auto landmark = std::ranges::find(map_.landmarks, range.landmark, &Landmark::name);
    if (!range.range_m || !range.bearing_rad || landmark == map_.landmarks.end()) continue;
    const Eigen::Vector2d p_BL_m =
        *range.range_m * Eigen::Vector2d(std::cos(*range.bearing_rad), std::sin(*range.bearing_rad));
    for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
      Json points = Json::array();
      for (const auto& px : outline_px(vision::of_view(*rig_, side), p_BL_m, landmark->radius_m, landmark->top_m)) {
        points.push_back(pixel_of(px));
      }
      if (points.empty()) continue;
      outlines.push_back({{"landmark", range.landmark}, {"view", to_string(side)}, {"points_px", std::move(points)}});
    }
  }
  json["outlines"] = std::move(outlines);
  return json;
}

}  // namespace twocone::telemetry
