// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/sections.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/compare/both_runs.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/report/kit/html.h"
#include "apps/runlog/storage/image_file.h"
#include "localisation/odometry.h"
#include "vision/unwrap.h"

namespace twocone::compare {
namespace {

constexpr int kWidest_px = 640;
const cv::Size kStrip_px{840, 132};

cv::Mat read(const std::filesystem::path& file, const std::string& what, std::vector<std::string>& notes) {
  const auto noted = [&](const std::string& text) {
    notes.push_back(text);
    return cv::Mat();
  };
  if (file.empty()) return noted(fmt::format("There is no {} image.", what));
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return noted(fmt::format("The {} image is missing: {}", what, file.string()));
  }
  const auto image = runlog::read_rgb(file);
  return image ? *image : noted(fmt::format("The {} image cannot be read: {}", what, file.string()));
}

cv::Mat resized(const cv::Mat& image, cv::Size size) {
  if (image.size() == size) return image;
  cv::Mat fitted;
  cv::resize(image, fitted, size, 0, 0, cv::INTER_AREA);
  return fitted;
}

cv::Size shown_size(cv::Size size) {
  if (size.width <= kWidest_px) return size;
  return {kWidest_px, std::max(1, int(std::lround(double(size.height) * kWidest_px / size.width)))};
}

/// Returns the unrolled image. If the rig cannot unroll it, returns nothing and adds a note.
/// @param turned_rad added to the bearings
cv::Mat unrolled(const cv::Mat& image, const config::Robot& robot, double turned_rad, const char* side,
                 ExhibitView& view) {
  if (image.empty()) return {};
  const auto noted = [&](const std::exception& error) {
    view.notes.push_back(fmt::format("The {} {} image is not unrolled: {}", side, view.name(), error.what()));
    return cv::Mat();
  };
  try {
    const vision::Rig rig = config::to_rig(robot);
    vision::MirrorViewSettings settings = of_view(rig, view.view).settings();
    settings.azimuth_rad += std::isfinite(turned_rad) ? turned_rad : 0;
    // The image is unrolled at twice the width first, because near the rim it has more pixels than the strip.
    return resized(vision::unwrap(image, vision::MirrorView(settings), 2 * kStrip_px.width), kStrip_px);
  } catch (const config::FileError& error) {
    return noted(error);
  } catch (const std::invalid_argument& error) {
    return noted(error);
  }
}

void subtract(ExhibitView& images) {
  if (images.simulated_strip.empty() || images.real_strip.empty()) return;
  cv::Mat simulated, real;
  cv::cvtColor(images.simulated_strip, simulated, cv::COLOR_RGB2GRAY);
  cv::cvtColor(images.real_strip, real, cv::COLOR_RGB2GRAY);
  images.difference.create(real.size(), CV_8UC3);
  for (int row = 0; row < real.rows; ++row) {
    for (int column = 0; column < real.cols; ++column) {
      const int grey = real.at<std::uint8_t>(row, column) - simulated.at<std::uint8_t>(row, column);
      images.difference.at<cv::Vec3b>(row, column) = difference_colour(grey);
    }
  }
  images.mean_difference_grey = cv::norm(real, simulated, cv::NORM_L1) / double(real.total());
}

namespace html = report::html;
using report::escape;

/// Limit for the size of all images as data URIs. It allows the page to be sent by mail.
constexpr std::size_t kMostBytes = 4'500'000;

std::string svg(cv::Size size, const std::string& title, const std::string& inner) {
  return fmt::format(
      "<svg viewBox=\"0 0 {} {}\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\"><title>{}</title>{}</svg>\n",
      size.width, size.height, escape(title), inner);
}

std::string jpeg(const cv::Mat& image, const std::string& id, int quality) {
  return fmt::format("<image id=\"{}\" width=\"{}\" height=\"{}\" href=\"{}\"/>", id, image.cols, image.rows,
                     report::jpeg_uri(estimation::as_image(image), quality));
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
    return fmt::format("rgb({},{},{})", c[0], c[1], c[2]);
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

cv::Vec3b difference_colour(double grey) {
  // A red and a blue similar to Okabe and Ito's, which people with any common kind of colour vision can distinguish.
  const cv::Vec3d none(247, 247, 247);
  const cv::Vec3d end = grey > 0 ? cv::Vec3d(180, 60, 0) : cv::Vec3d(0, 70, 150);
  const double part = std::min(std::abs(grey) / kStrongestDifference_grey, 1.0);
  const cv::Vec3d colour = none + (end - none) * part;
  return {cv::saturate_cast<std::uint8_t>(colour[0]), cv::saturate_cast<std::uint8_t>(colour[1]),
          cv::saturate_cast<std::uint8_t>(colour[2])};
}

std::array<ExhibitView, 2> read_images(const Comparison& comparison, const Exhibit& exhibit) {
  std::array<ExhibitView, 2> views;
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const auto k = std::size_t(side);
    ExhibitView& images = views[k];
    images.view = side;
    const cv::Mat simulated = read(exhibit.simulated_images[k], "simulated " + images.name(), images.notes);
    const cv::Mat real = read(exhibit.real_images[k], "real " + images.name(), images.notes);
    // The headings of both bodies differ, so a direction in the world has different bearings from them.
    const double turned_rad =
        std::remainder(exhibit.simulated.heading_rad - exhibit.real.heading_rad, 2 * std::numbers::pi);
    images.simulated_strip = unrolled(simulated, comparison.simulated_robot, turned_rad, "simulated", images);
    images.real_strip = unrolled(real, comparison.real_robot, 0, "real", images);
    subtract(images);
    if (!simulated.empty()) images.simulated = resized(simulated, shown_size(simulated.size()));
    if (real.empty()) continue;
    images.real = resized(real, simulated.empty() ? shown_size(real.size()) : images.simulated.size());
    if (!simulated.empty() && simulated.size() != real.size()) {
      images.notes.push_back(
          fmt::format("The real {} image, {} \u00d7 {} px, is drawn at the size of the simulated one, {} \u00d7 {} "
                      "px, so that both can be blended.",
                      images.name(), real.cols, real.rows, simulated.cols, simulated.rows));
    }
  }
  return views;
}

std::string exhibits_html(const Comparison& comparison, std::vector<std::string>& notes) {
  if (comparison.exhibits.empty()) return "";
  std::vector<std::array<ExhibitView, 2>> images;
  for (const Exhibit& exhibit : comparison.exhibits) {
    images.push_back(read_images(comparison, exhibit));
    for (const ExhibitView& view : images.back()) {
      std::ranges::copy_if(view.notes, std::back_inserter(notes),
                           [&](const std::string& note) { return std::ranges::find(notes, note) == notes.end(); });
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
