// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "apps/report/kit/figure.h"
#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

using report::gnuplot_string;

constexpr int kFilled = 7, kOpen = 6, kCross = 2;

/// Okabe and Ito's colours, with different shapes for print in black and white. Faint: the same hue, mixed with white.
struct Look {
  Level level;
  std::string_view colour, faint;
  int open, filled;  ///< gnuplot's point types
  double size;
};
constexpr std::array<Look, 5> kLooks{{{Level::kPaper, "#555555", "#b8b8b8", 4, 5, 0.72},
                                      {Level::kFound, "#cc79a7", "#e6bdd2", 8, 9, 0.9},
                                      {Level::kCoarse, "#e69f00", "#f2cc80", 12, 13, 0.95},
                                      {Level::kFine, "#0072b2", "#94c3de", kOpen, kFilled, 0.8},
                                      {Level::kAdaptive, "#d55e00", "#eeb48a", 10, 11, 0.9}}};
constexpr std::string_view kInk = "#222222", kSoft = "#666666";

const Look& look_of(Level level) {
  return *std::find_if(kLooks.begin(), kLooks.end(), [&](const Look& look) { return look.level == level; });
}

/// Returns a place in gnuplot's notation: as fractions of the image, from its lower edge.
std::string screen(Pixel at, const Plane& plane) {
  return fmt::format("screen {:.6f},{:.6f}", at.x / plane.width_px, 1 - at.y / plane.height_px);
}

/// The gnuplot commands of one image; everything except the data is placed in pixels.
class Script {
 public:
  explicit Script(const Plane& plane) : plane_(plane) {}

  void set_up() {
    const LogAxis &x = plane_.x, &y = plane_.y;
    text_ += fmt::format("set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\n", x.low_px / plane_.width_px,
                         x.high_px / plane_.width_px);
    text_ += fmt::format("set bmargin at screen {:.6f}\nset tmargin at screen {:.6f}\n",
                         1 - y.low_px / plane_.height_px, 1 - y.high_px / plane_.height_px);
    text_ += fmt::format("set logscale xy\nset xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\n", x.low, x.high,
                         y.low, y.high);
    text_ += fmt::format("set xtics ({})\nset ytics ({})\nunset key\n", tics(x), tics(y));
    text_ += "set grid back lc rgb '#ececec' lw 1 dt solid\nset bars 0.6\n";
  }
  void raw(std::string_view commands) { text_ += commands; }

  /// @param side left, center or right: the end of the words that is placed at `at`
  void words(Pixel at, std::string_view words, std::string_view side, std::string_view colour, int size = 12) {
    text_ += fmt::format("set label {} at {} {} front font 'sans-serif,{}' tc rgb '{}'\n", gnuplot_string(words),
                         screen(at, plane_), side, size, colour);
  }
  void symbol(Pixel at, int type, double size, std::string_view colour, double line = 1.4) {
    text_ += fmt::format("set label '' at {} front point pt {} ps {} lw {} lc rgb '{}'\n", screen(at, plane_), type,
                         size, line, colour);
  }
  void line(Pixel from, Pixel to, std::string_view style) {
    text_ += fmt::format("set arrow from {} to {} nohead {}\n", screen(from, plane_), screen(to, plane_), style);
  }
  /// Adds a plot of `rows` of values.
  void plot(std::string_view rows, std::string_view with) {
    if (rows.empty()) return;
    const std::string name = fmt::format("d{}", plots_.size());
    blocks_ += report::data_block(name, rows);
    plots_.push_back(fmt::format("${} {}", name, with));
  }
  [[nodiscard]] std::string str() const { return text_ + blocks_ + report::plot_command(plots_); }

 private:
  static std::string tics(const LogAxis& axis) {
    std::string text;
    for (const auto& [value, label] : axis.tics()) {
      text += fmt::format("{}{} {:.9g}", text.empty() ? "" : ", ", gnuplot_string(label), value);
    }
    return text;
  }

  const Plane& plane_;
  std::string text_, blocks_;
  std::vector<std::string> plots_;
};

std::string pair(PlanePoint point) { return fmt::format("{:.9g} {:.9g}\n", point.x, point.y); }

/// Returns the corners of a staircase that falls at each point, from above the first point to beyond the last.
std::vector<PlanePoint> stairs(const std::vector<PlanePoint>& points, const Plane& plane) {
  std::vector<PlanePoint> corners;
  if (points.empty()) return corners;
  double y = plane.y.high;
  for (const PlanePoint& point : points) {
    corners.push_back({point.x, y});
    corners.push_back(point);
    y = point.y;
  }
  corners.push_back({plane.x.high, y});
  return corners;
}

std::string rows_of(const std::vector<PlanePoint>& points) {
  std::string rows;
  for (const PlanePoint& point : points) rows += pair(point);
  return rows;
}

/// Settings with a label beside them, whether they are on the frontier or not.
struct Named {
  std::optional<std::size_t> baseline, as_is;
  [[nodiscard]] bool is_solid(const Mark& mark) const {
    return mark.on_frontier || mark.setting == baseline || mark.setting == as_is;
  }
};

/// Draws open marks with white inside, because lines would otherwise show through.
void draw_marks(Script& script, const Sweep& sweep, const Plane& plane, const Named& named) {
  for (const bool solid : {false, true}) {
    for (const Look& look : kLooks) {
      std::array<std::string, 2> rows;  // of one frame, of several
      std::string silent, bars;
      for (const Mark& mark : plane.marks) {
        const Setting& setting = sweep.settings[mark.setting].setting;
        const bool is_solid = named.is_solid(mark);
        if (setting.level != look.level || is_solid != solid) continue;
        (mark.answers_enough || is_solid ? rows[setting.frames > 1 ? 1 : 0] : silent) += pair(mark.at);
        if (!solid) continue;
        const auto within = [](double value, const LogAxis& axis) { return std::clamp(value, axis.low, axis.high); };
        bars += fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g}\n", mark.at.x, mark.at.y,
                            within(mark.x.low, plane.x), within(mark.x.high, plane.x), within(mark.y.low, plane.y),
                            within(mark.y.high, plane.y));
      }
      const std::string_view colour = solid ? look.colour : look.faint;
      const double size = look.size * (solid ? 1.0 : 0.85);
      script.plot(silent, fmt::format("using 1:2 with points pt {} ps 0.5 lw 1.2 lc rgb '{}'", kCross, look.faint));
      script.plot(bars, fmt::format("using 1:2:3:4:5:6 with xyerrorbars pt 0 lw 1.1 lc rgb '{}'", look.colour));
      script.plot(rows[0], fmt::format("using 1:2 with points pt {} ps {} lc rgb '#ffffff'", look.filled, size));
      script.plot(rows[0],
                  fmt::format("using 1:2 with points pt {} ps {} lw 1.5 lc rgb '{}'", look.open, size, colour));
      script.plot(rows[1], fmt::format("using 1:2 with points pt {} ps {} lc rgb '{}'", look.filled, size, colour));
    }
  }
}

/// Draws a filled star as a polygon, because gnuplot has no such mark.
void draw_star(Script& script, Pixel at, double radius_px, const Plane& plane) {
  std::string corners;
  for (int i = 0; i <= 10; ++i) {
    const double angle = i * std::numbers::pi / 5;
    const double radius = i % 2 == 0 ? radius_px : 0.4 * radius_px;
    const Pixel corner{at.x + radius * std::sin(angle), at.y - radius * std::cos(angle)};
    corners += (i == 0 ? "from " : " to ") + screen(corner, plane);
  }
  script.raw(fmt::format("set object polygon {} front fillcolor rgb '{}' fillstyle solid 1 noborder\n", corners, kInk));
}

/// Returns the areas that words must not cover.
Placing crowded(const Plane& plane, const Named& named) {
  Placing placing({plane.x.low_px + 2, plane.y.high_px, plane.x.high_px, plane.y.low_px - 2});
  constexpr double kHalf_px = 6;
  for (const Mark& mark : plane.marks) {
    const Pixel at = plane.pixel(mark.at);
    const bool solid = named.is_solid(mark);
    placing.keep_clear({at.x - kHalf_px, at.y - kHalf_px, at.x + kHalf_px, at.y + kHalf_px}, solid ? 3 : 0.6);
    if (!solid) continue;
    const auto pixel = [&](double x, double y) {
      return plane.pixel({std::clamp(x, plane.x.low, plane.x.high), std::clamp(y, plane.y.low, plane.y.high)});
    };
    placing.keep_clear(pixel(mark.at.x, mark.y.low), pixel(mark.at.x, mark.y.high), 1);
    placing.keep_clear(pixel(mark.x.low, mark.at.y), pixel(mark.x.high, mark.at.y), 1);
  }
  const std::vector<PlanePoint> corners = stairs(plane.frontier, plane);
  for (const auto* line : {&corners, &plane.bound}) {
    for (std::size_t i = 1; i < line->size(); ++i) {
      placing.keep_clear(plane.pixel((*line)[i - 1]), plane.pixel((*line)[i]), 0.8);
    }
  }
  return placing;
}

/// @param radius_px radius of the mark at `point`
void put_words(Script& script, Placing& placing, Pixel point, double radius_px, std::string_view words) {
  constexpr int kSize = 12;
  constexpr double kWidthOfHeight = 0.52, kThreadFrom_px = 6;
  const double width = double(words.size()) * kSize * kWidthOfHeight + 2;
  const double height = kSize + 1;
  const Pixel at = placing.place(point, width, height);
  const Pixel near{std::clamp(point.x, at.x - width / 2, at.x + width / 2),
                   std::clamp(point.y, at.y - height / 2, at.y + height / 2)};
  const double reach = std::hypot(near.x - point.x, near.y - point.y);
  if (reach > radius_px + kThreadFrom_px) {  // a thin line from the words to their mark
    const double share = radius_px / reach;
    script.line(near, {point.x + (near.x - point.x) * share, point.y + (near.y - point.y) * share},
                "front lw 0.8 lc rgb '#9a9a9a'");
  }
  // Fonts differ in width, so the text is anchored at the end that is nearer to the mark.
  const double left = at.x - width / 2, right = at.x + width / 2;
  if (left > point.x) return script.words({left, at.y}, words, "left", kInk, kSize);
  if (right < point.x) return script.words({right, at.y}, words, "right", kInk, kSize);
  script.words(at, words, "center", kInk, kSize);
}

/// Draws the paper's star, the numbers of the frontier, the ring of the choice, and labels beside settings that the
/// list does not name.
void draw_words(Script& script, const Plane& plane, const Named& named, const Choice* choice) {
  constexpr double kStar_px = 9, kMark_px = 6;
  const Pixel paper = plane.pixel(plane.paper);
  draw_star(script, paper, kStar_px, plane);
  Placing placing = crowded(plane, named);
  placing.keep_clear({paper.x - kStar_px, paper.y - kStar_px, paper.x + kStar_px, paper.y + kStar_px}, 5);
  int number = 0;
  for (const Mark& mark : plane.marks) {
    if (choice != nullptr && choice->setting == mark.setting) {
      script.plot(pair(mark.at), fmt::format("using 1:2 with points pt {} ps 1.5 lw 1.8 lc rgb '{}'", kOpen, kInk));
    }
    if (mark.on_frontier) put_words(script, placing, plane.pixel(mark.at), kMark_px, fmt::to_string(++number));
  }
  put_words(script, placing, paper, kStar_px,
            fmt::format("the paper, 2006: {:.0f} mm, about {:g} s{}", kPaperMeanError_m / kMm, kPaperTime_s,
                        plane.cost == Cost::kRobotTime ? " a stereo frame" : ""));
  for (const Mark& mark : plane.marks) {
    const Pixel at = plane.pixel(mark.at);
    if (mark.setting == named.baseline) put_words(script, placing, at, kMark_px, "method paper, measured here");
    if (mark.setting == named.as_is) put_words(script, placing, at, kMark_px, "robot file, unchanged");
  }
}

/// Draws the key in two columns at the upper right.
void draw_key(Script& script, const Sweep& sweep, const Plane& plane, const Choice* choice) {
  const double left = plane.x.high_px + 34, right = left + 118, pitch = 17;
  double y = plane.y.high_px + 2;
  script.words({left - 8, y}, "estimator", "left", kSoft, 11);
  for (const Look& look : kLooks) {
    const auto has_level = [&](const SettingResult& result) { return result.setting.level == look.level; };
    if (std::ranges::none_of(sweep.settings, has_level)) continue;
    y += pitch;
    script.symbol({left, y}, look.filled, look.size, look.colour);
    script.words({left + 12, y}, name(look.level), "left", kInk);
  }
  y = plane.y.high_px + 2;
  const Look& fine = look_of(Level::kFine);
  const auto entry = [&](std::string_view words) {
    script.words({right + 16, y}, words, "left", kInk);
    y += pitch;
  };
  const auto mark = [&](std::string_view words, int type, double size, std::string_view colour, double line = 1.4) {
    script.symbol({right, y}, type, size, colour, line);
    entry(words);
  };
  mark("from one frame", fine.open, fine.size, fine.colour, 1.5);
  mark("from several frames", fine.filled, fine.size, fine.colour);
  mark("dominated", fine.filled, fine.size, fine.faint);
  if (!std::ranges::all_of(plane.marks, &Mark::answers_enough)) {
    mark(fmt::format("answers under {:.0f} %", kLeastAnswered * 100), kCross, 0.5, "#999999", 1.2);
  }
  script.line({right - 10, y}, {right + 10, y}, "lw 2 lc rgb '#8a949e'");
  entry("frontier");
  if (!plane.bound.empty()) {
    script.line({right - 10, y}, {right + 10, y}, fmt::format("lw 1.8 dt (7,4) lc rgb '{}'", report::kBoundColour));
    entry("bound (Cram\u00e9r-Rao), rms");
  }
  if (choice != nullptr && choice->setting) mark("the choice", kOpen, 1.5, kInk, 1.8);
}

void draw_list(Script& script, const Sweep& sweep, const Plane& plane) {
  const Usual usual = usual_of(sweep);
  const double left = plane.x.high_px + 26;
  double y = plane.y.high_px + 168;
  script.words({left, y}, "on the frontier", "left", kSoft, 11);
  script.words({left + 276, y}, "mm", "right", kSoft, 11);
  script.words({left + 332, y}, plane.cost == Cost::kRobotTime ? "ms" : "s", "right", kSoft, 11);
  int number = 0;
  for (const Mark& mark : plane.marks) {
    if (!mark.on_frontier) continue;
    y += 17;
    script.words({left + 14, y}, fmt::to_string(++number), "right", kInk, 11);
    script.words({left + 20, y}, short_name(sweep.settings[mark.setting].setting, usual), "left", kInk, 11);
    script.words({left + 276, y}, significant(mark.at.y), "right", kInk, 11);
    script.words({left + 332, y}, significant(mark.at.x), "right", kInk, 11);
  }
}

}  // namespace

report::Plot drawing_of(const Sweep& sweep, const Plane& plane, const Choice* choice) {
  const bool robot = plane.cost == Cost::kRobotTime;
  const Named named{baseline_of(sweep), sweep.as_is};
  Script script(plane);
  script.set_up();
  script.raw(
      fmt::format("set ylabel 'mean position error / mm' offset 1,0\nset xlabel {} offset 0,0.2\n",
                  gnuplot_string(robot ? "robot time of a frame / ms (95 % quantile, one core)"
                                       : "simulation time of a frame / s (robot time and rendering, one core)")));
  script.plot(rows_of(stairs(plane.frontier, plane)), "using 1:2 with lines lw 2 lc rgb '#8a949e'");
  script.plot(rows_of(plane.bound),
              fmt::format("using 1:2 with lines lw 1.8 dt (7,4) lc rgb '{}'", report::kBoundColour));
  draw_marks(script, sweep, plane, named);
  draw_words(script, plane, named, choice);
  draw_key(script, sweep, plane, choice);
  draw_list(script, sweep, plane);

  report::Plot plot;
  plot.stem = robot ? "robot_time" : "simulation_time";
  plot.title = robot ? "Mean position error against the robot's time for a frame"
                     : "Mean position error against the simulation's time for a frame";
  plot.width_px = plane.width_px;
  plot.height_px = plane.height_px;
  plot.commands = script.str();
  return plot;
}

}  // namespace twocone::tradeoff
