// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/look/checks.h"
#include "apps/report/kit/svg.h"
#include "apps/runlog/storage/image_file.h"

namespace twocone::look {
namespace {

/// Space around the plan for title, axes and key.
constexpr double kLeft_px = 64, kRight_px = 24, kTop_px = 74, kBottom_px = 96;
/// The drawing's width is that of the image, but not less, so that the title and the key have their space.
constexpr double kLeastWidth_px = 900, kMostWidth_px = 1200, kTallest_px = 1100;
constexpr int kJpegQuality = 88;
constexpr double kTick_m = 0.5;

/// The text of an SVG file of a part of the world, x to the right and y up.
class Plan {
 public:
  explicit Plan(const sim_povray::OverheadView& view) : view_(view) {
    const double wide_m = view.max_x_m - view.min_x_m;
    const double tall_m = view.max_y_m - view.min_y_m;
    px_per_m_ = std::min({kMostWidth_px / wide_m, kTallest_px / tall_m});
    px_per_m_ = std::max(px_per_m_, std::min(kLeastWidth_px / wide_m, kTallest_px / tall_m));
    width_px_ = wide_m * px_per_m_;
    height_px_ = tall_m * px_per_m_;
  }

  [[nodiscard]] double x(double x_m) const { return kLeft_px + (x_m - view_.min_x_m) * px_per_m_; }
  [[nodiscard]] double y(double y_m) const { return kTop_px + (view_.max_y_m - y_m) * px_per_m_; }
  [[nodiscard]] double px(double length_m) const { return length_m * px_per_m_; }
  [[nodiscard]] double width_px() const { return width_px_; }
  [[nodiscard]] double height_px() const { return height_px_; }

  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }
  void circle(std::string_view style, const Disc& disc) {
    add("<circle class=\"{}\" cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"/>", style, x(disc.centre.x_m),
        y(disc.centre.y_m), px(disc.radius_m));
  }
  void words(std::string_view style, double at_x, double at_y, std::string_view plain) {
    add("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>", style, at_x, at_y, report::escape(plain));
  }

  [[nodiscard]] std::string str() const {
    return fmt::format(
        R"(<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">
{2}{3}</svg>
)",
        kLeft_px + width_px_ + kRight_px, kTop_px + height_px_ + kBottom_px, kStyle, text_);
  }

 private:
  static constexpr std::string_view kStyle = R"(<style>
text { font-family: system-ui, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif; font-size: 14px; fill: #1d2329; }
.title { font-size: 22px; font-weight: 650; }
.soft { fill: #5a646e; }
.tick { fill: #5a646e; font-size: 13px; }
.middle { text-anchor: middle; }
.end { text-anchor: end; }
.name { font-size: 15px; font-weight: 600; text-anchor: middle; fill: #ffffff; stroke: #1d2329; stroke-width: 3.5px; stroke-linejoin: round; paint-order: stroke; }
.grid { stroke: #ffffff; stroke-opacity: 0.16; stroke-width: 1; }
.frame { fill: none; stroke: #1d2329; stroke-width: 1; }
.bounds { fill: none; stroke: #0b5cad; stroke-width: 2.5; stroke-dasharray: 10 5; }
.obstacle { fill: #2f8fe8; fill-opacity: 0.24; stroke: #0b5cad; stroke-width: 2; stroke-linejoin: round; }
.landmark { fill-opacity: 0.35; stroke: #ffffff; stroke-width: 4.5; }
.landmark-edge { fill: none; stroke: #1d2329; stroke-width: 1.8; }
.way { fill: none; stroke: #ffffff; stroke-opacity: 0.9; stroke-width: 2; stroke-dasharray: 2 6; stroke-linecap: round; }
.waypoint { fill: #ffffff; stroke: #1d2329; stroke-width: 1; }
.robot { fill: #ffffff; fill-opacity: 0.55; stroke: #1d2329; stroke-width: 2.5; }
.heading { fill: none; stroke: #1d2329; stroke-width: 3; stroke-linecap: round; stroke-linejoin: round; }
.uncovered { fill: #e0261b; fill-opacity: 0.6; shape-rendering: crispEdges; }
.shown-edge { fill: none; stroke: #ffffff; stroke-width: 5; }
.shown { fill: none; stroke: #e0261b; stroke-width: 2.5; stroke-dasharray: 6 4; }
.badge { fill: #e0261b; stroke: #ffffff; stroke-width: 2; }
.number { font-size: 13px; font-weight: 700; text-anchor: middle; fill: #ffffff; }
.bar { fill: none; stroke: #1d2329; stroke-width: 3; }
.bad { fill: #b3261b; font-weight: 600; }
</style>
)";

  const sim_povray::OverheadView view_;
  double px_per_m_ = 1;
  double width_px_ = 0, height_px_ = 0;
  std::string text_;
};

/// Returns the multiples of kTick_m, or of a larger step in a large room, from `low` to `high`.
std::vector<double> ticks(double low, double high) {
  constexpr double kMostTicks = 20;
  const double step = kTick_m * std::max(1.0, std::ceil((high - low) / kTick_m / kMostTicks));
  std::vector<double> values;
  for (double i = std::ceil(low / step); i * step <= high; ++i) values.push_back(i * step);
  return values;
}

void draw_axes(Plan& plan, const sim_povray::OverheadView& view) {
  const double bottom = kTop_px + plan.height_px();
  for (const double value : ticks(view.min_x_m, view.max_x_m)) {
    plan.add("<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>", plan.x(value), kTop_px, bottom);
    plan.words("tick middle", plan.x(value), bottom + 18, fmt::format("{:g}", value + 0.0));
  }
  for (const double value : ticks(view.min_y_m, view.max_y_m)) {
    plan.add("<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", kLeft_px, plan.y(value), kLeft_px + plan.width_px());
    plan.words("tick end", kLeft_px - 7, plan.y(value) + 4.5, fmt::format("{:g}", value + 0.0));
  }
  plan.words("soft middle", kLeft_px + plan.width_px() / 2, bottom + 38, "x in metres");
  plan.add("<text class=\"soft middle\" transform=\"translate(20 {:.1f}) rotate(-90)\">y in metres</text>",
           kTop_px + plan.height_px() / 2);
}

void draw_map(Plan& plan, const config::Map& map) {
  const config::Bounds& b = map.bounds;
  plan.add("<rect class=\"bounds\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>", plan.x(b.min_x_m),
           plan.y(b.max_y_m), plan.px(b.max_x_m - b.min_x_m), plan.px(b.max_y_m - b.min_y_m));
  for (const config::Obstacle& obstacle : map.obstacles) {
    if (const auto* disc = std::get_if<Disc>(&obstacle)) {
      plan.circle("obstacle", *disc);
      continue;
    }
    std::string points;
    for (const FloorPoint& p : std::get<config::Polygon>(obstacle)) {
      points += fmt::format("{:.1f},{:.1f} ", plan.x(p.x_m), plan.y(p.y_m));
    }
    plan.add("<polygon class=\"obstacle\" points=\"{}\"/>", points);
  }
}

void draw_landmarks(Plan& plan, const config::Map& map) {
  const double middle_y_m = (map.bounds.min_y_m + map.bounds.max_y_m) / 2;
  for (const Landmark& landmark : map.landmarks) {
    const Disc disc{{landmark.x_m, landmark.y_m}, landmark.radius_m};
    plan.add("<circle class=\"landmark\" fill=\"{}\" cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"/>",
             report::own_colour(landmark.colour), plan.x(landmark.x_m), plan.y(landmark.y_m),
             plan.px(landmark.radius_m));
    plan.circle("landmark-edge", disc);
    plan.add("<path class=\"landmark-edge\" d=\"M{:.2f} {:.2f}m-5 0h10m-5 -5v10\"/>", plan.x(landmark.x_m),
             plan.y(landmark.y_m));
    // Towards the middle of the room, where there is space.
    const double side = landmark.y_m < middle_y_m ? -1 : 1;
    const double away = plan.px(landmark.radius_m) + 8;
    plan.words("name", plan.x(landmark.x_m), plan.y(landmark.y_m) + side * away + (side > 0 ? 11 : 0), landmark.name);
  }
}

void draw_robot(Plan& plan, const config::Robot& robot) {
  std::string way;
  for (const FloorPoint& p : robot.waypoints) {
    way += fmt::format("{}{:.1f} {:.1f}", way.empty() ? "M" : "L", plan.x(p.x_m), plan.y(p.y_m));
  }
  if (!way.empty()) plan.add("<path class=\"way\" d=\"{}Z\"/>", way);
  for (const FloorPoint& p : robot.waypoints) {
    plan.add("<circle class=\"waypoint\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>", plan.x(p.x_m), plan.y(p.y_m));
  }
  const localisation::Pose start = config::to_start_pose(robot);
  plan.circle("robot", {{start.x_m, start.y_m}, robot.body_radius_m});
  const double reach = plan.px(robot.body_radius_m);
  plan.add(
      "<path class=\"heading\" transform=\"translate({:.1f} {:.1f}) rotate({:.2f})\" "
      "d=\"M0 0H{:.1f}m{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}\"/>",
      plan.x(start.x_m), plan.y(start.y_m), -start.heading_rad * 180 / std::numbers::pi, 1.45 * reach, -0.3 * reach,
      -0.22 * reach, 0.3 * reach, 0.22 * reach, -0.3 * reach, 0.22 * reach);
  plan.words("name", plan.x(start.x_m), plan.y(start.y_m) + reach + 19, "robot");
}

void draw_findings(Plan& plan, const Look& look) {
  for (const FloorPoint& p : look.uncovered) {
    plan.add("<rect class=\"uncovered\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.2f}\"/>",
             plan.x(p.x_m - kCell_m / 2), plan.y(p.y_m + kCell_m / 2), plan.px(kCell_m), plan.px(kCell_m));
  }
  std::map<std::pair<double, double>, int> at_place;
  for (std::size_t i = 0; i < look.findings.size(); ++i) {
    const Finding& finding = look.findings[i];
    if (finding.in_scene) {
      plan.circle("shown-edge", *finding.in_scene);
      plan.circle("shown", *finding.in_scene);
    }
    // Several findings of one place stand side by side.
    const double shift = 24 * at_place[{finding.place.x_m, finding.place.y_m}]++;
    plan.add("<g transform=\"translate({:.1f} {:.1f})\"><title>{}</title><circle class=\"badge\" r=\"11\"/>",
             plan.x(finding.place.x_m) + shift, plan.y(finding.place.y_m), report::escape(finding.text));
    plan.words("number", 0, 4.5, std::to_string(i + 1));
    plan.add("</g>");
  }
}

void draw_key(Plan& plan, const Look& look, bool has_waypoints) {
  const double y = kTop_px + plan.height_px() + 70;
  double x = kLeft_px;
  // The widths are those of the words in the common sans-serif fonts.
  const auto entry = [&](std::string_view mark, std::string_view words, double width) {
    plan.add("<g transform=\"translate({:.1f} {:.1f})\">{}</g>", x, y - 5, mark);
    plan.words("", x + 34, y, words);
    x += width;
  };
  entry(R"(<rect class="bounds" x="0" y="-8" width="26" height="16"/>)", "bounds", 100);
  entry(R"(<rect class="obstacle" x="0" y="-8" width="26" height="16"/>)", "obstacle", 112);
  entry(
      R"(<circle class="landmark" fill="#9aa4ad" cx="13" cy="0" r="9"/><circle class="landmark-edge" cx="13" cy="0" r="9"/>)",
      "landmark", 116);
  if (has_waypoints) {
    entry(
        R"(<path class="bar" style="stroke:#5a646e;stroke-width:2;stroke-dasharray:2 6" d="M0 0H26"/><circle class="waypoint" cx="13" cy="0" r="4"/>)",
        "waypoints", 122);
  }
  if (!look.findings.empty()) {
    entry(R"(<circle class="badge" cx="13" cy="0" r="10"/>)", "disagreement, by its number", 220);
  }
  const double length = plan.px(1);
  const double end = kLeft_px + plan.width_px();
  plan.add("<path class=\"bar\" d=\"M{0:.1f} {2:.1f}v8H{1:.1f}v-8\"/>", end - length, end, y - 12);
  plan.words("middle", end - length / 2, y + 14, "1 m");
}

}  // namespace

std::string draw_above(const Subject& subject, const Look& look, const sim_povray::OverheadView& view,
                       const std::optional<Image>& above) {
  Plan plan(view);
  plan.add("<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>");
  plan.words("title", kLeft_px, 32, fmt::format("{} from above", subject.map.file.filename().string()));
  plan.words("soft", kLeft_px, 56,
             above ? fmt::format("image: {} below {:.2f} m;  drawn over it: what {} and {} say",
                                 subject.map.scene->filename().string(), view.height_m,
                                 subject.map.file.filename().string(), subject.robot.file.filename().string())
                   : fmt::format("what {} and {} say", subject.map.file.filename().string(),
                                 subject.robot.file.filename().string()));
  plan.words(look.findings.empty() ? "soft end" : "bad end", kLeft_px + plan.width_px(), 32,
             look.findings.empty()
                 ? (look.has_surfaces ? "no disagreement found" : "the map was not compared with the scene")
             : look.findings.size() == 1 ? "1 disagreement"
                                         : fmt::format("{} disagreements", look.findings.size()));
  if (above) {
    plan.add(
        "<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" preserveAspectRatio=\"none\" "
        "xlink:href=\"{}\"/>",
        kLeft_px, kTop_px, plan.width_px(), plan.height_px(), runlog::jpeg_uri(*above, kJpegQuality));
  } else {
    plan.add("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#c9ced2\"/>", kLeft_px, kTop_px,
             plan.width_px(), plan.height_px());
  }
  draw_axes(plan, view);
  draw_map(plan, subject.map);
  draw_landmarks(plan, subject.map);
  draw_robot(plan, subject.robot);
  draw_findings(plan, look);
  plan.add("<rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>", kLeft_px, kTop_px,
           plan.width_px(), plan.height_px());
  draw_key(plan, look, !subject.robot.waypoints.empty());
  return plan.str();
}

}  // namespace twocone::look
