// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/sections.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "apps/compare/show/images.h"
#include "apps/compare/side.h"
#include "apps/report/kit/html.h"
#include "localisation/odometry.h"

namespace twocone::compare {
namespace {

namespace html = report::html;
using report::escape;

/// Limit for all images as data URIs, so that the page can be sent by mail.
constexpr std::size_t kMostBytes = 4'500'000;

std::string svg(cv::Size size, const std::string& title, const std::string& inner) {
  return fmt::format(
      "<svg viewBox=\"0 0 {} {}\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\"><title>{}</title>{}</svg>\n",
      size.width, size.height, escape(title), inner);
}

std::string jpeg(const cv::Mat& image, const std::string& id, int quality) {
  return fmt::format("<image id=\"{}\" width=\"{}\" height=\"{}\" href=\"{}\"/>", id, image.cols, image.rows,
                     report::jpeg_uri(image, quality));
}

std::string captioned(const std::string& drawing, const std::string& words) {
  return html::element("figure", drawing + html::text("figcaption", words));
}

std::string side_by_side(const ExhibitView& view, const std::string& prefix, int quality) {
  std::string inner;
  for (const auto& [side, image] : {std::pair{"simulated", &view.simulated}, std::pair{"real", &view.real}}) {
    if (image->empty()) continue;
    const std::string words = view.name() + ", " + side;
    inner += captioned(svg(image->size(), words, jpeg(*image, prefix + side, quality)), words);
  }
  return inner;
}

/// Returns the real image over the simulated one. It refers to the images that the page already contains.
std::string blended(const ExhibitView& view, const std::string& prefix) {
  if (view.simulated.empty() || view.real.empty()) return "";
  return captioned(svg(view.simulated.size(), view.name() + ", blended",
                       fmt::format("<use href=\"#{0}simulated\"/><use class=\"over\" href=\"#{0}real\"/>", prefix)),
                   view.name() + ", real over simulated");
}

std::string bearing_axis() {
  std::string words;
  for (const char* word : {"behind", "left 90\u00b0", "ahead", "right 90\u00b0", "behind"}) {
    words += html::text("span", word);
  }
  return html::element("div", words, "class=\"bearings\"");
}

std::string strips(const ExhibitView& view, const std::string& prefix, int quality) {
  std::string inner;
  for (const auto& [name, image] : {std::pair{"simulated", &view.simulated_strip}, std::pair{"real", &view.real_strip},
                                    std::pair{"difference", &view.difference}}) {
    if (image->empty()) continue;
    inner += html::text("span", name, "class=\"strip-name\"");
    inner += svg(image->size(), fmt::format("{}, {}, unrolled", view.name(), name),
                 jpeg(*image, prefix + name + "-strip", quality));
  }
  if (inner.empty()) return "";
  std::string caption = fmt::format("{} mirror unrolled", view.view == vision::Side::kLower ? "Lower" : "Upper");
  if (view.mean_difference_grey) {
    caption += fmt::format("; the brightness differs by {:.1f} grey levels on average", *view.mean_difference_grey);
  }
  return html::element("figure", html::element("div", inner, "class=\"strips\"") + bearing_axis() +
                                     html::text("figcaption", caption + "."));
}

std::string difference_legend() {
  const auto rgb = [](double grey) {
    const cv::Vec3b c = difference_colour(grey);
    return fmt::format("rgb({},{},{})", c[2], c[1], c[0]);
  };
  return html::element(
      "p",
      fmt::format("{}<span class=\"ramp\" style=\"background:linear-gradient(to right,{},{},{})\"></span>{}",
                  escape(fmt::format("Difference: real darker by {} grey levels or more ", kStrongestDifference_grey)),
                  rgb(-kStrongestDifference_grey), rgb(0), rgb(kStrongestDifference_grey),
                  escape(" real brighter; white: equal. The simulated strip is turned by the difference of the "
                         "headings, so that bearings of the world line up.")),
      "class=\"soft\"");
}

std::string name_of(const Exhibit& exhibit) {
  const runlog::PoseRow &a = exhibit.simulated, &b = exhibit.real;
  return fmt::format("t = {:.2f} s simulated, {:.2f} s real; {:.1f} mm and {:.2f}\u00b0 apart", a.t_s, b.t_s,
                     std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) * 1000,
                     std::abs(localisation::wrap_angle_rad(a.heading_rad - b.heading_rad)) / kDegree);
}

std::string exhibits_at(const Comparison& comparison, const std::vector<std::array<ExhibitView, 2>>& images,
                        int quality) {
  std::string text;
  for (std::size_t i = 0; i < images.size(); ++i) {
    std::string notes, whole, blends, unrolled;
    for (const ExhibitView& view : images[i]) {
      const std::string prefix = fmt::format("e{}-{}-", i, view.name());
      for (const std::string& note : view.notes) notes += html::text("p", note, "class=\"warning\"");
      whole += html::element("div", side_by_side(view, prefix, quality), "class=\"pairs\"");
      blends += blended(view, prefix);
      unrolled += strips(view, prefix, quality);
    }
    text += html::shown_frame(
        fmt::format("{}{}{}{}", notes, whole, html::element("div", blends, "class=\"pairs\""), unrolled),
        name_of(comparison.exhibits[i]), i == 0);
  }
  return text;
}

std::string sliders(const Comparison& comparison) {
  const std::string choice = fmt::format(
      "<label for=\"frame-choice\">frame</label><input id=\"frame-choice\" type=\"range\" min=\"0\" max=\"{}\" "
      "value=\"0\" disabled=\"disabled\"/>",
      comparison.exhibits.size() - 1);
  const std::string blend =
      "<label for=\"blend\">blend: simulated</label><input id=\"blend\" type=\"range\" min=\"0\" max=\"100\" "
      "value=\"50\" disabled=\"disabled\"/><span>real</span>";
  return html::element(
      "div",
      html::element("div", choice + html::text("output", name_of(comparison.exhibits.front()), "id=\"frame-name\""),
                    "class=\"slider\"") +
          html::element("div", blend, "class=\"slider\""),
      "class=\"sliders\"");
}

}  // namespace

std::string exhibits_html(const Comparison& comparison, std::vector<std::string>& notes) {
  if (comparison.exhibits.empty()) return "";
  std::vector<std::array<ExhibitView, 2>> images;
  for (const Exhibit& exhibit : comparison.exhibits) {
    images.push_back(read_images(comparison, exhibit));
    for (const ExhibitView& view : images.back()) {
      for (const std::string& note : view.notes) {
        if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
      }
    }
  }
  // Noise makes large images, so their quality is lowered until the page is small enough.
  std::string frames;
  for (const int quality : {85, 75, 60, 45, 30}) {
    frames = exhibits_at(comparison, images, quality);
    if (frames.size() <= kMostBytes) break;
  }
  return sliders(comparison) + frames + difference_legend();
}

}  // namespace twocone::compare
