// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/report/data.h"
#include "apps/report/paper.h"
#include "apps/report/report.h"
#include "apps/runlog/summary/bounds.h"
#include "apps/telemetry/telemetry.h"

namespace twocone::report {
namespace {

using Json = nlohmann::ordered_json;

/// Digits of places, ranges and times, and of what is known to a few percent only. More would make the page larger.
constexpr int kManyDigits = 8, kFewDigits = 5;

/// Returns a number to that many digits; null for a missing one.
Json number(std::optional<double> value, int digits = kManyDigits) {
  if (!value || !std::isfinite(*value)) return {};
  return std::strtod(fmt::format("{:.{}g}", *value, digits).c_str(), nullptr);
}

Json columns_of(const runlog::RunData& run, const std::vector<runlog::PoseRow>& poses) {
  Json x_m = Json::array(), y_m = Json::array();
  for (const std::optional<runlog::PoseRow>& pose : runlog::at_frames(run, poses)) {
    x_m.push_back(pose ? number(pose->x_m) : Json());
    y_m.push_back(pose ? number(pose->y_m) : Json());
  }
  return {{"x_m", std::move(x_m)}, {"y_m", std::move(y_m)}};
}

/// Returns a landmark with its ranges, one for each frame.
Json landmark_json(const runlog::RunData& run, const config::Landmark& landmark, Json json) {
  if (const auto* figures = paper::find_landmark(landmark.name)) {
    json["paper"] = {{"figure", figures->figure}, {"mean_mm", figures->mean_mm}, {"max_mm", figures->max_mm}};
  }
  if (const auto rounding_m = rounding_error_m(run, landmark)) json["rounding_error_m"] = number(*rounding_m);
  std::map<std::uint64_t, const runlog::RangeRow*> rows;
  for (const runlog::RangeRow& row : run.ranges) {
    if (row.landmark == landmark.name) rows[row.frame] = &row;
  }
  static const runlog::RangeRow kNone;
  Json verdict = Json::array(), range_m = Json::array(), sigma_m = Json::array(), true_m = Json::array();
  for (const runlog::FrameRow& frame : run.frames) {
    const auto found = rows.find(frame.frame);
    const runlog::RangeRow& row = found == rows.end() ? kNone : *found->second;
    verdict.push_back(found == rows.end() ? Json() : Json(row.verdict));
    range_m.push_back(number(row.range_m));
    sigma_m.push_back(number(row.sigma_range_m, kFewDigits));
    true_m.push_back(number(row.true_range_m));
  }
  json["verdict"] = std::move(verdict);
  json["range_m"] = std::move(range_m);
  json["sigma_range_m"] = std::move(sigma_m);
  json["true_range_m"] = std::move(true_m);
  return json;
}

Json landmarks_json(const runlog::RunData& run) {
  const Json map = telemetry::Lines(run.robot, run.map).run("", run.info, {})["map"];
  Json landmarks = Json::array();
  for (std::size_t i = 0; i < run.map.landmarks.size(); ++i) {
    landmarks.push_back(landmark_json(run, run.map.landmarks[i], map["landmarks"][i]));
  }
  return landmarks;
}

/// Returns the columns of the fixes. An ambiguous frame has two.
Json fixes_json(const runlog::RunData& run) {
  Json json{{"frame", Json::array()}, {"t_s", Json::array()}, {"verdict", Json::array()}};
  for (const runlog::FixRow& row : run.fixes) {
    json["frame"].push_back(row.frame);
    json["t_s"].push_back(number(row.t_s));
    json["verdict"].push_back(row.verdict);
    for (const auto& [name, value] :
         {std::pair{"x_m", row.x_m}, {"y_m", row.y_m}, {"true_x_m", row.true_x_m}, {"true_y_m", row.true_y_m}}) {
      json[name].push_back(number(value));
    }
    for (const auto& [name, value] : {std::pair{"error_m", row.error_m},
                                      {"var_x_m2", row.var_x_m2},
                                      {"cov_xy_m2", row.cov_xy_m2},
                                      {"var_y_m2", row.var_y_m2}}) {
      json[name].push_back(number(value, kFewDigits));
    }
  }
  return json;
}

/// Returns the Cramer-Rao bound of each frame's position: 1 sigma of the distance.
Json bounds_json(const runlog::RunData& run) {
  std::map<std::uint64_t, double> of_frame;
  for (const runlog::FrameBound& bound : runlog::bounds(run)) {
    if (!bound.covariance) continue;
    of_frame[bound.frame] = std::sqrt((*bound.covariance)(0, 0) + (*bound.covariance)(1, 1));
  }
  if (of_frame.empty()) return {};
  Json json = Json::array();
  for (const runlog::FrameRow& frame : run.frames) {
    const auto found = of_frame.find(frame.frame);
    json.push_back(found == of_frame.end() ? Json() : number(found->second, kFewDigits));
  }
  return json;
}

/// Returns the sizes of the rig as believed, for figure 8.
Json rig_json(const runlog::RunData& run) {
  const config::Rig& rig = run.robot.rig;
  const vision::Rig views = config::to_rig(run.robot);
  const auto view_json = [](const vision::MirrorView& view) -> Json {
    const vision::ConeMirror& cone = view.settings().cone;
    return {{"lens_height_m", view.settings().lens_height_m},
            {"lens_to_tip_m", cone.lens_to_tip_m},
            {"mirror_radius_m", cone.rim_radius_m},
            {"apex_rad", cone.apex_rad}};
  };
  Json json{{"lower", view_json(views.lower)},
            {"upper", view_json(views.upper)},
            {"mirror_separation_m", rig.mirror_separation_m}};
  if (!is_right_angled(rig)) return json;
  json["nearest_common_m"] = nearest_common_m(rig);
  // (range + d)^2 times this is the change of range for one pixel of disparity.
  const double d = rig.lower.lens_to_tip_m;
  json["range_per_pixel_factor"] = range_per_pixel_m(rig, 0) / (d * d);
  for (const config::Landmark& landmark : run.map.landmarks) {
    json["nearest_top_m"].push_back(nearest_top_m(rig, landmark.top_m));
  }
  return json;
}

Json facts_json(const runlog::RunData& run, const runlog::Summary& summary) {
  const auto joined = [](const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); };
  Json facts = Json::array();
  const auto add = [&facts](const char* name, std::string value) {
    facts.push_back(Json::array({name, std::move(value)}));
  };
  add("twocone", fmt::format("{}, commit {}", run.info.version, run.info.commit));
  add("compiler", run.info.compiler);
  add("robot", fmt::format("{} ({})", run.robot.name, run.robot.file.string()));
  add("map", run.map.file.string());
  add("scene", run.map.scene ? run.map.scene->string() : "none: a real room");
  add("behaviour", run.info.behaviour);
  add("method", run.method == run.info.method
                    ? run.method
                    : fmt::format("{} (the run itself used {})", run.method, run.info.method));
  add("seed", fmt::to_string(run.info.seed));
  add("frames", fmt::format("{} of {}, {:.2f} s", summary.frames, run.info.frames_wanted, summary.duration_s));
  add("images", fmt::format("{} x {} px at {:g} Hz", run.robot.lower.settings.width_px,
                            run.robot.lower.settings.height_px, run.robot.lower.settings.rate_hz));
  if (run.info.finished && run.info.wall_s > 0) {
    add("time taken",
        fmt::format("{:.1f} s, of which {:.1f} s waiting for images; processor {:.1f} s here, {:.1f} s in POV-Ray",
                    run.info.wall_s, run.info.render_wait_s, run.info.own_cpu_s, run.info.render_cpu_s));
  }
  for (const config::KeyChange& change : run.robot.changes) add("changed key", to_string(change));
  if (const auto& names = run.robot.estimator.landmarks; !names.empty()) {
    add("searched for only", fmt::format("{}", fmt::join(names, ", ")));
  }
  if (const auto timing = runlog::summarise_timing(run)) {
    add("vision and localisation, per frame", joined(timing_words(*timing)));
  }
  for (const std::string& device : run.info.devices) add("device", device);
  if (summary.capture) add("cameras", joined(capture_words(*summary.capture)));
  return facts;
}

/// Returns the run's tables that exist, by their paths from the report.
Json files_json(const runlog::RunData& run) {
  Json files = Json::array();
  for (const char* name : {"run.yaml", "summary.json", "frames.csv", "drive.csv", "ranges.csv", "sightings.csv",
                           "fixes.csv", "track.csv", "landmarks.csv", "scan.csv", "plan.csv", "timing.csv", "truth.tum",
                           "odometry.tum", "estimate.tum", "telemetry.jsonl", "run.log"}) {
    std::error_code ignored;
    if (std::filesystem::exists(run.folder / name, ignored)) files.push_back(name);
  }
  return files;
}

}  // namespace

// The keys:
//   title, method, finished, frames_wanted, unit_m
//   summary, baseline: as summary.json; no baseline: the run has none
//   paper: its numbers of the position; landmarks: as in the telemetry, with the paper's numbers and the columns of
//   their ranges; frame, t_s, truth, odometry, estimate, bound_m: columns, which all have one entry for each frame;
//   fixes: columns. Missing entries are null. They hold every frame, also of a run whose telemetry does not.
//   rig; repeat: the command; exact: whether it repeats the run byte for byte; facts: names and values; events; files
Json run_json(const runlog::RunData& run, const runlog::Summary& summary,
              const std::optional<runlog::Summary>& baseline) {
  Json json{
      {"title", fmt::format("twocone run: robot {}, method {}, seed {}", run.robot.name, run.method, run.info.seed)},
      {"method", run.method},
      {"finished", run.info.finished},
      {"frames_wanted", run.info.frames_wanted},
      {"unit_m", run.map.unit_m},
      {"has_truth", has_truth(summary)},
      {"has_bounds", has_bounds(summary)},
      {"summary", Json::parse(runlog::to_json(summary, run.info))}};
  if (baseline) json["baseline"] = Json::parse(runlog::to_json(*baseline, run.info));
  json["paper"] = {{"position_mean_mm", paper::kPositionMean_mm},
                   {"position_within_mm", paper::kPositionWithin_mm},
                   {"figure_17_frames", paper::kFigure17Frames}};
  json["landmarks"] = landmarks_json(run);
  json["frame"] = json["t_s"] = Json::array();
  for (const runlog::FrameRow& frame : run.frames) {
    json["frame"].push_back(frame.frame);
    json["t_s"].push_back(number(frame.t_s));
  }
  for (const auto& [name, poses] :
       {std::pair{"truth", &run.truth}, {"odometry", &run.odometry}, {"estimate", &run.estimate}}) {
    if (!poses->empty()) json[name] = columns_of(run, *poses);
  }
  if (Json bounds = bounds_json(run); !bounds.is_null()) json["bound_m"] = std::move(bounds);
  json["fixes"] = fixes_json(run);
  json["rig"] = rig_json(run);
  const auto timing = runlog::summarise_timing(run);
  json["repeat"] = {{"command", repeat_command(run.info, run.robot, run.method)},
                    {"exact", !(timing && timing->budget_s)}};
  json["facts"] = facts_json(run, summary);
  json["events"] = run.info.events;
  json["files"] = files_json(run);
  return json;
}

}  // namespace twocone::report
