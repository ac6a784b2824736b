// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/report/kit/figure.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/sweep.h"

/// The content of a sweep's images, and the parts of the page with them. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// The cost on the horizontal axis.
enum class Cost { kRobotTime, kSimulationTime };

/// A point of an image, in pixels from its upper left corner.
struct Pixel {
  double x = 0, y = 0;
};

/// A logarithmic axis with its range of values and pixels.
struct LogAxis {
  double low = 0, high = 0;  ///< in the axis's unit, 0 < low < high
  double low_px = 0, high_px = 0;
  [[nodiscard]] double px(double value) const;
  /// Returns value and label of each tic: 1, 2 and 5 in each decade; if there are many decades, 1 only.
  [[nodiscard]] std::vector<std::pair<double, std::string>> tics() const;
};

/// A point in the axes' units.
struct PlanePoint {
  double x = 0, y = 0;
};

/// A setting in the image.
struct Mark {
  std::size_t setting = 0;  ///< index in Sweep::settings
  PlanePoint at;
  Interval x, y;
  bool on_frontier = false;
  bool answers_enough = false;
};

/// An image of error over cost, with all settings of a sweep.
struct Plane {
  Cost cost = Cost::kRobotTime;
  int width_px = 0, height_px = 0;
  double unit_s = 1;  ///< unit of x, seconds; the unit of y is a millimetre
  LogAxis x, y;
  std::vector<Mark> marks;           ///< the marks on the frontier come last, by rising cost
  std::vector<PlanePoint> frontier;  ///< by rising cost
  std::vector<PlanePoint> bound;     ///< the lowest bound among settings of at most this cost, by rising cost
  PlanePoint paper;                  ///< the paper's own result

  [[nodiscard]] Pixel pixel(PlanePoint point) const { return {x.px(point.x), y.px(point.y)}; }
};

/// Returns the content of an image. Settings whose error or cost is not a positive number are left out.
Plane plane_of(const Sweep& sweep, Cost cost);

// ---- free space for labels

/// A rectangle, in pixels.
struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
};

/// Records the occupied areas of an image, and finds free space beside a point.
class Placing {
 public:
  /// @param frame limits the space
  explicit Placing(Box frame) : frame_(frame) {}

  /// Records an area. @param weight penalty for covering it
  void keep_clear(Box box, double weight);
  /// Records a line as boxes along it.
  void keep_clear(Pixel from, Pixel to, double weight);

  /// Returns the middle of the best place for `width` by `height` pixels beside `point`, and records that place as
  /// occupied. Of two places that cover equally little, the nearer one is better; of equally near ones, the one below
  /// and to the left.
  Pixel place(Pixel point, double width, double height);

 private:
  struct Kept {
    Box box;
    double weight;
  };
  Box frame_;
  std::vector<Kept> kept_;
};

// ---- the page

/// Returns a setting with its accuracy and costs, in lines of plain text.
std::string tooltip(const SettingResult& result);

/// Returns the image as a plot for gnuplot. @param choice marked; may be null
report::Plot drawing_of(const Sweep& sweep, const Plane& plane, const Choice* choice);

/// Returns the styles that the page needs in addition to the report's.
std::string_view page_style();

/// Returns the page's script. It shows a tooltip beside the pointer or the focus, moves from point to point with the
/// arrow keys, and sorts the table at a click on a column head. Without it the circles' own titles are shown.
std::string_view page_script();

}  // namespace twocone::tradeoff
