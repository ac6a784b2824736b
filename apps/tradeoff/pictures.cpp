// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "apps/tradeoff/output.h"
#include "apps/tradeoff/show/drawing.h"
#include "apps/tradeoff/show/hover.h"
#include "apps/tradeoff/show/page.h"
#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

std::string caption_of(const Sweep& sweep, const Plane& plane) {
  std::string text =
      plane.cost == Cost::kRobotTime
          ? "Robot time: vision and localisation of one frame on one core, the quantile that 95 % of frames keep: what "
            "--budget-ms bounds. The paper's star is for a whole stereo frame on the computer of its day, ranging "
            "included."
          : "Simulation time: robot time and the median processor time of rendering both pictures.";
  text +=
      " Solid: on the frontier, with 95 % intervals; nothing swept is below the stairs. Dashed: through the least "
      "Cram\u00e9r-Rao bounds of settings fine and adaptive, with all landmarks of the map and, for "
      "several frames, wheels that tell their way exactly; they are root mean squares, and a mean error may be as "
      "little "
      "as 0.8 of its own.";
  const auto silent =
      std::count_if(sweep.settings.begin(), sweep.settings.end(), [](const SettingResult& r) { return !r.position_m; });
  if (silent > 0)
    text += fmt::format(" {} of {} settings never answered and are not drawn.", silent, sweep.settings.size());
  return text + " Point at a mark, or go to it with Tab and the arrow keys, for its setting.";
}

}  // namespace

Status write_pictures(const Sweep& sweep, const Choice* choice, const std::filesystem::path& folder) {
  constexpr std::chrono::milliseconds kTimeout{30'000};
  const std::filesystem::path figures = folder / "figures";
  const report::Gnuplot gnuplot("gnuplot", figures, kTimeout);
  if (Status ready = gnuplot.prepare(); !ready) return ready;

  std::vector<PagePicture> pictures;
  for (const Cost cost : {Cost::kSimulationTime, Cost::kRobotTime}) {
    const Plane plane = plane_of(sweep, cost);
    const report::Plot plot = drawing_of(sweep, plane, choice);
    const Result<std::string> svg = gnuplot.draw(plot);
    if (!svg) return svg.error();
    pictures.push_back({plot.stem, caption_of(sweep, plane), with_spots(*svg, sweep, plane)});
  }
  return report::write_file(folder / "index.html", page(sweep, pictures, choice));
}

}  // namespace twocone::tradeoff
