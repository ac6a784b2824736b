// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/report/kit/figure.h"
#include "apps/report/kit/html.h"
#include "apps/runlog/storage/image_file.h"
#include "vision/paper_ranging.h"
#include "vision/unwrap.h"

namespace twocone::report {
namespace {

struct Images {
  cv::Mat lower, upper;  ///< CV_8UC3, r g b
};

std::optional<Images> read_images(const runlog::RunData& run, std::uint64_t frame) {
  const auto lower = runlog::read_rgb(runlog::lower_image_file(run.folder, frame));
  const auto upper = runlog::read_rgb(runlog::upper_image_file(run.folder, frame));
  if (!lower || !upper) return std::nullopt;
  return Images{*lower, *upper};
}

std::string svg_begin(double width, double height, const std::string& title) {
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<svg viewBox=\"0 0 {:.0f} {:.0f}\" "
      "xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
      "font-family=\"sans-serif\" font-size=\"14\">\n<title>{}</title>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
      width, height, escape(title));
}

/// Returns text that is readable on any image.
std::string svg_label(double x, double y, std::string_view anchor, const std::string& text) {
  return fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"#ffffff\" stroke=\"#000000\" stroke-width=\"3\" "
      "paint-order=\"stroke\" stroke-linejoin=\"round\">{}</text>\n",
      x, y, anchor, escape(text));
}

/// Returns the affine map from the upper image to the lower one that makes equal bearings and elevations coincide.
cv::Mat upper_to_lower(const vision::Rig& rig) {
  std::array<cv::Point2f, 3> from, to;
  const double reach = rig.upper.settings().rim_radius_px;
  const double scale = rig.lower.focal_length_px() / rig.upper.focal_length_px();
  const std::array<std::pair<double, double>, 3> places{{{0, 0}, {0, reach}, {std::numbers::pi / 2, reach}}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [bearing, radius] = places[i];
    const Eigen::Vector2d u = rig.upper.settings().centre_px + rig.upper.offset_px(bearing, radius);
    const Eigen::Vector2d l = rig.lower.settings().centre_px + rig.lower.offset_px(bearing, radius * scale);
    from[i] = {float(u.x()), float(u.y())};
    to[i] = {float(l.x()), float(l.y())};
  }
  return cv::getAffineTransform(from, to);
}

Eigen::Vector2d apply(const cv::Matx23d& affine, const Eigen::Vector2d& p) {
  return {affine(0, 0) * p.x() + affine(0, 1) * p.y() + affine(0, 2),
          affine(1, 0) * p.x() + affine(1, 1) * p.y() + affine(1, 2)};
}

/// Returns the matches of the paper's method in these images, in the order of the map's landmarks. The list is empty if
/// the rig or the colours are outside the method's domain.
std::vector<vision::RangeMeasurement> match(const runlog::RunData& run, const Images& images) {
  try {
    const vision::PaperRanging ranging(config::to_rig(run.robot), config::to_targets(run.map), images.lower.size(),
                                       images.upper.size());
    return ranging.measure(images.lower, images.upper);
  } catch (const std::invalid_argument&) {
    return {};
  }
}

/// Returns the frames, the best first: by the number of ranges, then by the largest disparities, which are seen best.
std::vector<std::uint64_t> by_merit(const runlog::RunData& run) {
  std::map<std::uint64_t, std::pair<int, double>> merit;
  for (const runlog::FrameRow& frame : run.frames) merit[frame.frame] = {0, 0};
  for (const runlog::RangeRow& row : run.ranges) {
    const auto found = merit.find(row.frame);
    if (found == merit.end() || !row.range_m) continue;
    ++found->second.first;
    found->second.second += row.disparity_px.value_or(0);
  }
  std::vector<std::uint64_t> frames;
  frames.reserve(merit.size());
  for (const auto& [frame, value] : merit) frames.push_back(frame);
  std::ranges::stable_sort(frames, std::ranges::greater{}, [&](std::uint64_t frame) { return merit[frame]; });
  return frames;
}

/// Returns the indices of `count` of `run.frames`, evenly spaced, with the first and the last frame.
std::vector<std::size_t> spread(std::size_t frames, int count) {
  std::set<std::size_t> places;
  const int steps = std::max(1, count - 1);
  for (int i = 0; i < count && frames > 0; ++i) places.insert((frames - 1) * std::size_t(i) / std::size_t(steps));
  return {places.begin(), places.end()};
}

constexpr double kStripWidth = 960;
constexpr double kStripHeight = 150;  ///< height of one mirror's strip
constexpr double kStripLeft = 58;

double strip_x(double bearing_rad) { return kStripLeft + kStripWidth * (0.5 - bearing_rad / (2 * std::numbers::pi)); }

/// Writes the landmarks' names and ranges at their measured bearings over both views. Names that would overlap stand
/// one below the other.
std::string bearing_marks(const runlog::RunData& run, std::uint64_t frame, double top) {
  constexpr double kLetterWidth = 7.6;  // of 14 px sans-serif, rounded up
  constexpr double kLine = 17;
  struct Mark {
    double x, half_width;
    std::string text;
  };
  std::vector<Mark> marks;
  for (const runlog::RangeRow& row : run.ranges) {
    if (row.frame != frame || !row.bearing_rad) continue;
    const std::string text = row.range_m ? fmt::format("{} {:.2f} m", row.landmark, *row.range_m) : row.landmark;
    marks.push_back({strip_x(*row.bearing_rad), kLetterWidth * double(text.size()) / 2, text});
  }
  std::ranges::sort(marks, {}, &Mark::x);
  std::string svg;
  std::vector<double> line_ends;  // the right end of the last name of each line
  for (const Mark& mark : marks) {
    const double x = std::clamp(mark.x, kStripLeft + mark.half_width,
                                std::max(kStripLeft + mark.half_width, kStripLeft + kStripWidth - mark.half_width));
    const auto free = std::ranges::find_if(line_ends, [&](double end) { return end < x - mark.half_width; });
    const auto line = free - line_ends.begin();
    if (free == line_ends.end()) line_ends.push_back(0);
    line_ends[std::size_t(line)] = x + mark.half_width;
    const double y = top + 15 + kLine * double(line);
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1:.1f}V{2:.1f}\" stroke=\"#ffffff\" stroke-opacity=\"0.75\" stroke-dasharray=\"4 4\"/>\n",
        mark.x, y + 5, top + 2 * kStripHeight + 4);
    svg += svg_label(x, y, "middle", mark.text);
  }
  return svg;
}

/// Returns both views unrolled with their marks, from `top` downwards, 2 kStripHeight + 4 high.
std::string strip(const runlog::RunData& run, std::uint64_t frame, const Images& images, double top, int quality,
                  int image_width_px) {
  const vision::Rig rig = config::to_rig(run.robot);
  const int image_height_px = int(std::lround(image_width_px * kStripHeight / kStripWidth));
  std::string svg;
  double y = top;
  for (const auto& [name, image, view] :
       {std::tuple{"lower", &images.lower, &rig.lower}, std::tuple{"upper", &images.upper, &rig.upper}}) {
    cv::Mat small;
    cv::resize(vision::unwrap(*image, *view, 2 * image_width_px), small, {image_width_px, image_height_px}, 0, 0,
               cv::INTER_AREA);
    svg += svg_image(kStripLeft, y, kStripWidth, kStripHeight, jpeg_uri(estimation::as_image(small), quality));
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"#333333\">{}</text>\n",
                       kStripLeft - 8, y + kStripHeight / 2 + 5, name);
    y += kStripHeight + 4;
  }
  return svg + bearing_marks(run, frame, top);
}

std::string bearing_axis(double top) {
  std::string svg;
  for (const auto& [degrees, word] :
       {std::pair{180, "behind"}, {90, "left 90\u00b0"}, {0, "ahead"}, {-90, "right 90\u00b0"}, {-180, "behind"}}) {
    const double x = strip_x(degrees * std::numbers::pi / 180);
    const char* anchor = degrees == 180 ? "start" : degrees == -180 ? "end" : "middle";
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1:.1f}v5\" stroke=\"#777777\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" text-anchor=\"{3}\" "
        "fill=\"#333333\">{4}</text>\n",
        x, top, top + 20, anchor, word);
  }
  return svg;
}

Figure saved(const Drawing& drawing, Figure figure) {
  if (const Status written = write_file(drawing.gnuplot.folder / (figure.stem + ".svg"), figure.svg); !written) {
    drawing.notes.push_back("The figure \"" + figure.title +
                            "\" is in the report, but could not be written to the folder: " + written.error().message);
  }
  return figure;
}

}  // namespace

Figure draw_superimposed(const Drawing& drawing) {
  const runlog::RunData& run = drawing.run;
  std::optional<Images> images;
  std::uint64_t frame = 0;
  for (const std::uint64_t candidate : by_merit(run)) {
    images = read_images(run, candidate);
    frame = candidate;
    if (images) break;
  }
  if (!images) {
    drawing.notes.emplace_back("Figure 9 and the views are missing: the run has no images.");
    return {};
  }

  const vision::Rig rig = config::to_rig(run.robot);
  const cv::Mat affine = upper_to_lower(rig);
  cv::Mat upper, both;
  cv::warpAffine(images->upper, upper, affine, images->lower.size(), cv::INTER_LINEAR);
  cv::addWeighted(images->lower, 0.5, upper, 0.5, 0, both);

  // The square around the lower mirror, limited to the image.
  const vision::MirrorViewSettings& s = rig.lower.settings();
  const int reach = int(std::ceil(s.rim_radius_px)) + 6;
  const cv::Rect square(int(s.centre_px.x()) - reach, int(s.centre_px.y()) - reach, 2 * reach + 1, 2 * reach + 1);
  const cv::Rect crop = square & cv::Rect(0, 0, both.cols, both.rows);
  if (crop.empty()) {
    drawing.notes.emplace_back("Figure 9 is missing: the rig's mirror lies outside the lower image.");
    return {};
  }
  constexpr double kWidth = 720;
  const double scale = kWidth / crop.width;
  // Pixel (0, 0) is the centre of the first pixel in an image, and its corner in an SVG.
  const auto place = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector2d((p.x() + 0.5 - crop.x) * scale, (p.y() + 0.5 - crop.y) * scale);
  };

  Figure figure{"fig09_disparity", "Figure 9", "The disparity between the two mirrors"};
  figure.svg = svg_begin(kWidth, crop.height * scale, figure.title);
  figure.svg += svg_image(0, 0, kWidth, crop.height * scale, jpeg_uri(estimation::as_image(both(crop)), 85));
  std::vector<std::string> missing;
  const std::vector<vision::RangeMeasurement> matches = match(run, *images);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const vision::RangeMeasurement& m = matches[i];
    const config::Landmark& landmark = run.map.landmarks[i];
    if (m.verdict != vision::RangeVerdict::kOk || !m.lower_px || !m.upper_px) {
      missing.push_back(fmt::format("{} ({})", landmark.name, vision::to_string(m.verdict)));
      continue;
    }
    const Eigen::Vector2d a = place(*m.lower_px);
    const Eigen::Vector2d b = place(apply(affine, *m.upper_px));
    const std::string colour = own_colour(landmark.colour);
    for (const auto& [stroke, width] : {std::pair{std::string("#000000"), 4.5}, std::pair{colour, 2.0}}) {
      figure.svg += fmt::format(
          "<g fill=\"none\" stroke=\"{0}\" stroke-width=\"{1}\"><circle cx=\"{2:.1f}\" cy=\"{3:.1f}\" r=\"9\"/>"
          "<circle cx=\"{4:.1f}\" cy=\"{5:.1f}\" r=\"9\"/></g>\n",
          stroke, width, a.x(), a.y(), b.x(), b.y());
    }
    const Eigen::Vector2d centre = place(s.centre_px);
    const Eigen::Vector2d outwards = (a - centre).normalized();
    const Eigen::Vector2d sideways(-outwards.y(), outwards.x());
    const Eigen::Vector2d at = a + sideways * 18;  // outside the circles
    figure.svg += svg_label(at.x(), at.y() + 5, sideways.x() >= 0 ? "start" : "end", landmark.name);
  }
  figure.svg += "</svg>\n";
  figure.caption = fmt::format(
      "Frame {}: the upper mirror's image, half transparent, on the lower mirror's image. The circles show where the "
      "paper's algorithm matched the top of a landmark: the outer circle in the lower mirror, the inner one in the "
      "upper mirror.",
      frame);
  if (!missing.empty()) figure.caption += fmt::format(" No match: {}.", fmt::join(missing, ", "));
  return saved(drawing, std::move(figure));
}

Figure draw_strips(const Drawing& drawing) {
  const runlog::RunData& run = drawing.run;
  std::string strips;
  double y = 4;
  for (const std::size_t place : spread(run.frames.size(), 3)) {
    const runlog::FrameRow& frame = run.frames[place];
    const std::optional<Images> images = read_images(run, frame.frame);
    if (!images) continue;
    strips += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"#333333\">frame {}, t = {:.2f} s</text>\n",
                          kStripLeft, y + 14, frame.frame, frame.t_s);
    strips += strip(run, frame.frame, *images, y + 22, 78, 960);
    y += 22 + 2 * kStripHeight + 4 + 14;
  }
  if (strips.empty()) return {};
  Figure figure{"views_unwrapped", "", "Panorama of both mirrors"};
  figure.svg =
      svg_begin(kStripLeft + kStripWidth + 10, y + 16, figure.title) + strips + bearing_axis(y - 10) + "</svg>\n";
  figure.caption =
      "The two mirrors' images unrolled, lower above upper, on the same bearings: a landmark has the same bearing in "
      "both and stands higher in the lower mirror. Rows run from the rim (top) to the tip, which is the horizon of 90 "
      "degree cones.";
  return saved(drawing, std::move(figure));
}

std::vector<FrameView> frame_views(const runlog::RunData& run, int count) {
  std::vector<FrameView> views;
  for (const std::size_t place : spread(run.frames.size(), count)) {
    const runlog::FrameRow& frame = run.frames[place];
    const std::optional<Images> images = read_images(run, frame.frame);
    if (!images) continue;
    constexpr double kHeight = 2 * kStripHeight + 34;
    views.push_back({frame.frame, frame.t_s,
                     svg_begin(kStripLeft + kStripWidth + 10, kHeight, fmt::format("Frame {}", frame.frame)) +
                         strip(run, frame.frame, *images, 2, 70, 640) + bearing_axis(2 * kStripHeight + 8) +
                         "</svg>\n"});
  }
  return views;
}

}  // namespace twocone::report
