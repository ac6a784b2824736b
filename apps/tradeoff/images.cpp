// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "apps/tradeoff/output.h"
#include "apps/tradeoff/show/drawing.h"
#include "apps/tradeoff/show/page.h"

namespace twocone::tradeoff {
namespace {

std::string caption_of(const Sweep& sweep, const Plane& plane) {
  std::string text = plane.cost == Cost::kRobotTime
                         ? "Robot time: vision and localisation of one frame on one core, 95 % quantile. --budget-ms "
                           "limits this time. The paper's star is for a whole stereo frame on the computer of its day, "
                           "ranging included."
                         : "Simulation time: robot time plus the median processor time of rendering both images.";
  text +=
      " Solid marks are on the frontier, with 95 % intervals; no swept setting is below the staircase line. The dashed "
      "line connects the smallest Cram\u00e9r-Rao bounds of settings fine and adaptive, with all landmarks of the map "
      "and, for several frames, with wheels that measure their motion exactly. Bounds are root mean squares; a mean "
      "error can be as small as 0.8 times its own root mean square.";
  const auto silent =
      std::count_if(sweep.settings.begin(), sweep.settings.end(), [](const SettingResult& r) { return !r.position_m; });
  if (silent > 0)
    text += fmt::format(" {} of {} settings never answered and are not drawn.", silent, sweep.settings.size());
  return text + " Point at a mark, or select it with Tab and the arrow keys, to see its setting.";
}

}  // namespace

Status write_images(const Sweep& sweep, const Choice* choice, const std::filesystem::path& folder) {
  const report::Gnuplot gnuplot{"gnuplot", folder / "figures"};
  if (Status ready = gnuplot.prepare(); !ready) return ready;

  std::vector<PageImage> images;
  for (const Cost cost : {Cost::kSimulationTime, Cost::kRobotTime}) {
    const Plane plane = plane_of(sweep, cost);
    const report::Plot plot = drawing_of(sweep, plane, choice);
    const Result<std::string> svg = gnuplot.draw(plot);
    if (!svg) return svg.error();
    images.push_back({plot.stem, caption_of(sweep, plane), with_spots(*svg, sweep, plane)});
  }
  return report::write_file(folder / "index.html", page(sweep, images, choice));
}

}  // namespace twocone::tradeoff
