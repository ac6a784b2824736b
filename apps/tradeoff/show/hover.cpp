// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/hover.h"

#include <cmath>

#include <fmt/format.h>

#include "apps/report/markup.h"
#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

std::string frontiers(const SettingResult& result) {
  if (result.on_robot_frontier && result.on_simulation_frontier) return "on both frontiers";
  if (result.on_robot_frontier) return "on the frontier of robot time";
  if (result.on_simulation_frontier) return "on the frontier of simulation time";
  return answers_enough(result) ? "dominated" : "does not answer often enough for a frontier";
}

}  // namespace

std::string tooltip(const SettingResult& result) {
  std::string text = describe(result.setting) + "\n";
  if (const auto& error = result.position_m) {
    text += fmt::format("error: mean {} mm; 95 % below {} mm; max {} mm\n", with_interval(error->mean, kMm),
                        significant(error->p95.value / kMm), significant(error->max / kMm));
  }
  if (result.heading_rad)
    text += fmt::format("heading: mean {} deg\n", with_interval(result.heading_rad->mean, kDegree));
  text += fmt::format("answered: {} of {} frames", result.answered, result.frames);
  if (result.coverage) {
    text += fmt::format("; 95 % ellipses contain the truth in {:.0f} %", result.coverage->value * 100);
    if (std::isfinite(result.coverage->low) && std::isfinite(result.coverage->high)) {
      text += fmt::format(" ({:.0f} to {:.0f})", result.coverage->low * 100, result.coverage->high * 100);
    }
  }
  text += "\n";
  if (result.bound_m) text += fmt::format("bound (Cram\u00e9r-Rao), rms: {} mm\n", significant(*result.bound_m / kMm));
  text += fmt::format("robot: {} ms (95 % quantile); medians: vision {} ms, localisation {} ms\n",
                      with_interval(result.robot_time_s(), kMs), significant(result.vision.median_s.value / kMs),
                      significant(result.localisation.median_s.value / kMs));
  text += fmt::format("rendering: {} s; simulation: {} s\n", with_interval(result.render_cpu.median_s, 1),
                      significant(result.simulation_time_s().value));
  text += fmt::format("memory: {:.0f} MiB, POV-Ray {:.0f} MiB\n", result.peak_bytes / kMiB, result.render_bytes / kMiB);
  return text + frontiers(result);
}

std::string with_spots(std::string_view svg, const Sweep& sweep, const Plane& plane) {
  std::string spots = "<g class=\"spots\" fill=\"#000000\" fill-opacity=\"0\" pointer-events=\"all\">\n";
  for (const Mark& mark : plane.marks) {
    const Pixel at = plane.pixel(mark.at);
    constexpr double kRadius_px = 8;
    spots += fmt::format(
        "<circle class=\"spot\" cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" tabindex=\"{}\" role=\"img\" "
        "data-setting=\"{}\"><title>{}</title></circle>\n",
        at.x, at.y, kRadius_px, mark.on_frontier ? 0 : -1, mark.setting,
        report::escape(tooltip(sweep.settings[mark.setting])));
  }
  std::string text(svg);
  const std::size_t end = text.rfind("</svg>");
  return text.insert(end == std::string::npos ? text.size() : end, spots + "</g>\n");
}

}  // namespace twocone::tradeoff
