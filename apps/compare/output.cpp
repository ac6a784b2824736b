// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "apps/compare/compare.h"
#include "apps/config/calibration_file.h"
#include "apps/config/robot_file.h"
#include "apps/report/kit/plain_text.h"
#include "apps/runlog/version.h"
#include "apps/telemetry/telemetry.h"
#include "vision/image_quality.h"

namespace twocone::compare {
namespace {

using Json = nlohmann::ordered_json;

std::string decimal(const std::optional<double>& value) {
  if (!value) return "-";
  const double size = std::abs(*value);
  if (size >= 1000) return fmt::format("{:.0f}", *value);
  return size >= 100 ? fmt::format("{:.1f}", *value) : fmt::format("{:.3f}", *value);
}

/// Returns a paragraph of a terminal's width.
std::string paragraph(const std::string& first, const std::string& text) {
  constexpr std::size_t kColumns = 100;
  return report::paragraph(kColumns, first, "    ", text);
}

/// A smaller share of a gap gets no line of its own.
constexpr double kWorthALine = 0.05;

std::string plain_percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

std::string source_lines(const Source& source) {
  std::string text = fmt::format("  {}\n", source.name());
  for (const Component& c : source.components) {
    text += fmt::format("    {:<36} {:>10} -> {:>10}   {:+.3f} +- {:.3f} {}\n", c.name, decimal(c.simulated),
                        decimal(c.real), c.difference(), c.sigma, unit_after("", c.unit));
  }
  std::vector<std::string> shares;
  for (const Share& share : source.shares) {
    shares.push_back(fmt::format("{} of the gap in {}", plain_percent(share.share), to_string(share.of)));
  }
  if (!shares.empty()) text += paragraph("    ", fmt::format("explains {}", fmt::join(shares, ", ")));
  if (!source.confusable.empty()) {
    text += paragraph("    ",
                      fmt::format("this drive hardly distinguishes it from {}", fmt::join(source.confusable, ", ")));
  }
  return text + paragraph("    ", std::string(source.advice()));
}

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

/// Rounds to a millionth of a metre, second or radian.
Json micro(double value) { return std::isfinite(value) ? Json(std::round(value * 1e6) / 1e6) : Json(); }

/// Returns a list for each column. @param fields of an item, one for each name
template <typename Items, typename Fields>
Json columns_of(const Items& items, const std::vector<std::string>& names, const Fields& fields) {
  Json columns;
  for (const std::string& name : names) columns[name] = Json::array();
  for (const auto& item : items) {
    std::size_t column = 0;
    for (Json& value : fields(item)) columns[names[column++]].push_back(std::move(value));
  }
  return columns;
}

Json path_of(const std::vector<runlog::PoseRow>& poses) {
  return columns_of(poses, {"t_s", "x_m", "y_m", "heading_rad"}, [](const runlog::PoseRow& pose) {
    return std::vector<Json>{micro(pose.t_s), micro(pose.x_m), micro(pose.y_m), micro(pose.heading_rad)};
  });
}

/// Returns the points of a run, at most about kMostPoints: of each landmark one in `every`.
Json points_of(const std::vector<ResidualPoint>& all) {
  constexpr std::size_t kMostPoints = 2000;
  const std::size_t every = std::max<std::size_t>(1, all.size() / kMostPoints);
  std::map<std::size_t, std::size_t> count;
  std::vector<ResidualPoint> some;
  std::ranges::copy_if(all, std::back_inserter(some),
                       [&](const ResidualPoint& point) { return count[point.landmark]++ % every == 0; });
  Json json = columns_of(some, {"landmark", "t_s", "range_m", "before_m", "after_m"}, [](const ResidualPoint& point) {
    return std::vector<Json>{point.landmark, micro(point.t_s), point.range_m > 0 ? micro(point.range_m) : Json(),
                             micro(point.before_m), point.after_m ? micro(*point.after_m) : Json()};
  });
  json["every"] = every;
  return json;
}

Json exhibit_of(const Exhibit& exhibit) {
  const auto side = [](const runlog::PoseRow& pose, const std::array<std::filesystem::path, 2>& images) {
    return Json{{"t_s", pose.t_s},
                {"x_m", pose.x_m},
                {"y_m", pose.y_m},
                {"heading_rad", pose.heading_rad},
                {"images", {images[0].string(), images[1].string()}}};
  };
  return {{"simulated", side(exhibit.simulated, exhibit.simulated_images)},
          {"real", side(exhibit.real, exhibit.real_images)}};
}

Json to_json(const Source& source) {
  Json components = Json::array(), shares = Json::array();
  for (const Component& c : source.components) {
    components.push_back({{"name", c.name},
                          {"unit", c.unit},
                          {"simulated", c.simulated},
                          {"real", c.real},
                          {"difference", c.difference()},
                          {"sigma", c.sigma}});
  }
  for (const Share& share : source.shares) shares.push_back({{"of", to_string(share.of)}, {"share", share.share}});
  return {{"name", source.name()},     {"kind", to_string(source.cause)},
          {"where", source.where()},   {"verdict", to_string(source.verdict)},
          {"components", components},  {"chi_squared", source.chi_squared},
          {"p_value", source.p_value}, {"reason", source.reason},
          {"shares", shares},          {"hardly_told_from", source.confusable},
          {"advice", source.advice()}};
}

// ---- robot files

std::vector<std::string> header(const Outcome& outcome, const char* what) {
  const Comparison& c = outcome.comparison;
  std::vector<std::string> lines{fmt::format("{} by twocone {}, commit {}.", what, runlog::version(), runlog::commit()),
                                 fmt::format("  simulated run {}", c.simulated), fmt::format("  real run {}", c.real)};
  std::vector<std::string> names;
  for (const Source* const source : c.sources_with(SourceVerdict::kDiffers)) names.push_back(source->name());
  lines.push_back(names.empty() ? "No difference was found."
                                : fmt::format("Found to differ: {}.", fmt::join(names, ", ")));
  return lines;
}

/// Rounds to four digits for readable files. No measurement here has more digits.
double rounded(double value) { return value == 0 ? 0 : std::stod(fmt::format("{:.4g}", value)); }

void add_camera_effects(const Outcome& outcome, vision::Side view, sim_povray::CameraEffects& effects) {
  const std::vector<Source>& sources = outcome.comparison.sources;
  if (const Source* const gain = find_differing(sources, Cause::kExposureAndColour, view)) {
    double log_gain = 0;
    for (std::size_t colour = 0; colour < 3; ++colour) log_gain += std::log(gain->components[colour].real) / 3;
    effects.gain *= std::exp(log_gain);
    // The measured vignetting is the difference of both runs, so it is added to that of the simulation.
    const Component& vignetting = gain->components[3];
    if (std::abs(vignetting.real) >= 3 * vignetting.sigma) {
      effects.vignetting = std::clamp(effects.vignetting + vignetting.real, 0.0, 1.0);
    }
  }
  if (find_differing(sources, Cause::kNoise, view)) {
    if (const auto noise = vision::fit_noise(outcome.images.views[std::size_t(view)].real_noise)) {
      effects.full_well_electrons = noise->full_well_electrons();
      effects.read_noise_electrons = noise->read_noise_electrons();
    }
  }
  if (const Source* const blur = find_differing(sources, Cause::kSharpness, view)) {
    const double more_px = vision::defocus_radius_px(blur->components[0].simulated, blur->components[0].real);
    effects.defocus_px = std::hypot(effects.defocus_px, more_px);
  }
  if (const Source* const shutter = find_differing(sources, Cause::kRollingShutter, view)) {
    effects.readout_s = std::max(0.0, effects.readout_s + shutter->components[0].difference() / 1e3);
  }
  if (const Source* const lost = find_differing(sources, Cause::kFramesLost, view)) {
    effects.drop_probability = std::clamp(lost->components[0].real / 100, 0.0, 0.99);
  }
  double late_s = 0;
  if (const Source* const latency = find_differing(sources, Cause::kLatency))
    late_s += latency->components[0].difference() / 1e3;
  if (const Source* const skew = find_differing(sources, Cause::kSkew)) {
    // `stamp_late_s` is >= 0, so the view that is exposed earlier gets the later stamp.
    const double upper_later_s = skew->components[0].difference() / 1e3;
    late_s += std::max(0.0, view == vision::Side::kUpper ? -upper_later_s : upper_later_s);
  }
  effects.stamp_late_s = std::max(0.0, effects.stamp_late_s + late_s);
  for (double* const value :
       {&effects.gain, &effects.full_well_electrons, &effects.read_noise_electrons, &effects.vignetting,
        &effects.defocus_px, &effects.readout_s, &effects.drop_probability, &effects.stamp_late_s}) {
    *value = rounded(*value);
  }
}

}  // namespace

std::string table(const Comparison& comparison) {
  std::string text = fmt::format("simulated {} ({} frames)\nreal      {} ({} frames)\n", comparison.simulated,
                                 comparison.simulated_frames, comparison.real, comparison.real_frames);
  text += fmt::format("frames matched: {} by time, {} by place; poses of the real robot: {}\n",
                      comparison.matched_by_time, comparison.matched_by_pose, comparison.reference);
  for (const std::string& note : comparison.notes) text += paragraph("note: ", note);

  const auto differing = comparison.sources_with(SourceVerdict::kDiffers);
  text += differing.empty() ? "\nNo difference found.\n" : "\nDifferences (simulated -> real):\n";
  for (const Source* const source : differing) text += source_lines(*source);
  const auto agreeing = comparison.sources_with(SourceVerdict::kAgrees),
             undetermined = comparison.sources_with(SourceVerdict::kCannotTell);
  text += fmt::format("{} sources tested at {:.1g} each, {:.1g} for all; {} agree, {} cannot be determined.\n",
                      differing.size() + agreeing.size(), comparison.level, comparison.false_alarm, agreeing.size(),
                      undetermined.size());
  for (const Source* const source : undetermined) {
    text += paragraph("  cannot tell ", fmt::format("{}: {}", source->name(), source->reason));
  }

  if (!comparison.gaps.empty()) {
    text += fmt::format("\n{:<28} {:>10} {:>10} {:>10}   {}\n", "gap of the real run, rms", "measured", "corrected",
                        "floor", "unexplained");
  }
  for (const Gap& gap : comparison.gaps) {
    text += fmt::format("{:<28} {:>10} {:>10} {:>10}   {}\n", fmt::format("{}, {}", to_string(gap.of), gap.unit),
                        decimal(gap.before), decimal(gap.after), decimal(gap.floor),
                        gap.unexplained ? plain_percent(*gap.unexplained) : "-");
    if (gap.unnamed && std::abs(*gap.unnamed) >= kWorthALine) {
      text += paragraph(
          "  ", fmt::format("{} of it is corrected by numbers of the calibration that no source names as different",
                            plain_percent(*gap.unnamed)));
    }
  }

  std::optional<Stage> stage;
  // At most 100 columns.
  text += fmt::format("\n{:<52} {:>9} {:>9} {:>8} {:>6}\n", "", "simulated", "real", "+-", "limit");
  for (const Row& row : comparison.rows) {
    if (row.stage != stage) text += fmt::format("{}\n", to_string(row.stage));
    stage = row.stage;
    const bool is_gap_alone = !row.simulated && !row.real && row.gap;
    text += fmt::format("  {:<50} {:>9} {:>9} {:>8} {:>6} {}\n", row.name + unit_after(", ", row.unit),
                        decimal(row.simulated), decimal(is_gap_alone ? row.gap : row.real),
                        row.gap_sigma ? decimal(row.gap_sigma) : "", row.limit ? fmt::format("{:g}", *row.limit) : "",
                        row.light == Light::kNone ? "" : to_string(row.light));
  }
  text += paragraph("", "+-: standard deviation of real minus simulated; cannot tell: it exceeds the limit");
  return text;
}

std::string to_json(const Comparison& comparison) {
  Json rows = Json::array(), sources = Json::array(), gaps = Json::array(), limits = Json::object();
  Json exhibits = Json::array();
  for (const Row& row : comparison.rows) {
    rows.push_back({{"stage", to_string(row.stage)},
                    {"name", row.name},
                    {"unit", row.unit},
                    {"simulated", or_null(row.simulated)},
                    {"real", or_null(row.real)},
                    {"gap", or_null(row.gap)},
                    {"gap_sigma", or_null(row.gap_sigma)},
                    {"limit_key", row.limit_key},
                    {"limit", or_null(row.limit)},
                    {"light", to_string(row.light)},
                    {"note", row.note}});
    if (row.limit) limits[row.limit_key] = *row.limit;
  }
  for (const Source& source : comparison.sources) sources.push_back(to_json(source));
  for (const Gap& gap : comparison.gaps) {
    gaps.push_back({{"of", to_string(gap.of)},
                    {"unit", gap.unit},
                    {"before", gap.before},
                    {"after", gap.after},
                    {"floor", or_null(gap.floor)},
                    {"unexplained", or_null(gap.unexplained)},
                    {"unnamed", or_null(gap.unnamed)}});
  }
  for (const Exhibit& exhibit : comparison.exhibits) exhibits.push_back(exhibit_of(exhibit));
  const Json json{
      {"simulated", comparison.simulated},
      {"real", comparison.real},
      {"rendered_again", comparison.is_rendered},
      {"reference", comparison.reference},
      {"notes", comparison.notes},
      {"frames", {{"simulated", comparison.simulated_frames}, {"real", comparison.real_frames}}},
      {"matched", {{"by_time", comparison.matched_by_time}, {"by_pose", comparison.matched_by_pose}}},
      {"false_alarm", comparison.false_alarm},
      {"level", comparison.level},
      {"within_limits", comparison.is_within_limits()},
      {"limits", limits},
      {"gaps", gaps},
      {"sources", sources},
      {"rows", rows},
      {"exhibits", exhibits},
      {"map", telemetry::map_of(comparison.map)},
      {"paths",
       {{"simulated", path_of(comparison.simulated_path)},
        {"real", path_of(comparison.real_path)},
        {"odometry", path_of(comparison.real_odometry)}}},
      {"residuals",
       {{"simulated", points_of(comparison.simulated_residuals)}, {"real", points_of(comparison.real_residuals)}}}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string corrected_robot(const Outcome& outcome, const std::filesystem::path& new_file) {
  config::Robot robot = outcome.comparison.real_robot;
  robot.rig = outcome.calibration->rig;
  robot.rig.calibration = config::calibration_file_of(new_file);
  robot.drive.wheel_radius_m = outcome.calibration->drive.wheel_radius_m;
  robot.drive.wheel_separation_m = outcome.calibration->drive.wheel_separation_m;
  robot.drive.sigma = outcome.calibration->drive.sigma;
  return config::robot_text(robot.file, new_file, robot, header(outcome, "Rig and wheels as found in a real run"));
}

std::string like_the_real(const Outcome& outcome, const std::filesystem::path& new_file) {
  const Comparison& c = outcome.comparison;
  config::Robot robot = c.simulated_robot;
  add_camera_effects(outcome, vision::Side::kLower, robot.lower.effects);
  add_camera_effects(outcome, vision::Side::kUpper, robot.upper.effects);
  if (find_differing(c.sources, Cause::kWheelRadius) || find_differing(c.sources, Cause::kWheelSeparation)) {
    // Belief and truth are the same numbers: those of the corrected real robot.
    robot.drive.wheel_radius_m = outcome.calibration->drive.wheel_radius_m;
    robot.drive.wheel_separation_m = outcome.calibration->drive.wheel_separation_m;
    robot.effects.wheel_radius_m.reset();
    robot.effects.wheel_separation_m.reset();
  }
  if (const Source* const slip = find_differing(c.sources, Cause::kSlip))
    robot.effects.slip = rounded(slip->components[0].real / 100);
  if (const Source* const rate = find_differing(c.sources, Cause::kFrameRate)) {
    robot.lower.settings.rate_hz = robot.upper.settings.rate_hz = rounded(rate->components[0].real);
  }
  return config::robot_text(robot.file, new_file, robot,
                            header(outcome, "A simulation that behaves like a real run, made"));
}

}  // namespace twocone::compare
