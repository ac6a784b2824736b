// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/report/data.h"
#include "apps/runlog/storage/image_file.h"
#include "vision/paper_ranging.h"
#include "vision/unwrap.h"

namespace twocone::report {
namespace {

using Json = nlohmann::ordered_json;

struct Images {
  cv::Mat lower, upper;  ///< CV_8UC3, r g b
};

std::optional<Images> read_images(const runlog::RunData& run, std::uint64_t frame) {
  const auto lower = runlog::read_rgb(runlog::lower_image_file(run.folder, frame));
  const auto upper = runlog::read_rgb(runlog::upper_image_file(run.folder, frame));
  if (!lower || !upper) return std::nullopt;
  return Images{*lower, *upper};
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

Json place_json(const Eigen::Vector2d& p) { return {std::round(p.x() * 10) / 10, std::round(p.y() * 10) / 10}; }

}  // namespace

Json disparity_json(const runlog::RunData& run, std::vector<std::string>& notes) {
  std::optional<Images> images;
  std::uint64_t frame = 0;
  for (const std::uint64_t candidate : by_merit(run)) {
    images = read_images(run, candidate);
    frame = candidate;
    if (images) break;
  }
  if (!images) {
    notes.emplace_back("Figure 9 and the views are missing: the run has no images.");
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
    notes.emplace_back("Figure 9 is missing: the rig's mirror lies outside the lower image.");
    return {};
  }
  // Pixel (0, 0) is the centre of the first pixel in an image, and its corner in a figure.
  const auto place = [&](const Eigen::Vector2d& p) {
    return place_json(p + Eigen::Vector2d(0.5 - crop.x, 0.5 - crop.y));
  };
  Json matches = Json::array();
  const std::vector<vision::RangeMeasurement> measured = match(run, *images);
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const vision::RangeMeasurement& m = measured[i];
    Json json{{"landmark", run.map.landmarks[i].name}, {"verdict", vision::to_string(m.verdict)}};
    if (m.lower_px && m.upper_px) {
      json["lower_px"] = place(*m.lower_px);
      json["upper_px"] = place(apply(affine, *m.upper_px));
    }
    matches.push_back(std::move(json));
  }
  return {{"frame", frame},
          {"width_px", crop.width},
          {"height_px", crop.height},
          {"centre_px", place(s.centre_px)},
          {"image", runlog::jpeg_uri(estimation::as_image(both(crop)), 85)},
          {"matches", std::move(matches)}};
}

Json panoramas_json(const runlog::RunData& run) {
  constexpr int kFrames = 3;
  constexpr int kWidth_px = 960, kHeight_px = 150;
  Json panoramas = Json::array();
  for (const std::size_t row : spread(run.frames.size(), kFrames)) {
    const runlog::FrameRow& frame = run.frames[row];
    const std::optional<Images> images = read_images(run, frame.frame);
    if (!images) continue;
    const vision::Rig rig = config::to_rig(run.robot);
    Json json{{"frame", frame.frame}, {"t_s", frame.t_s}};
    for (const auto& [name, image, view] :
         {std::tuple{"lower", &images->lower, &rig.lower}, std::tuple{"upper", &images->upper, &rig.upper}}) {
      cv::Mat small;
      cv::resize(vision::unwrap(*image, *view, 2 * kWidth_px), small, {kWidth_px, kHeight_px}, 0, 0, cv::INTER_AREA);
      json[name] = runlog::jpeg_uri(estimation::as_image(small), 78);
    }
    json["marks"] = Json::array();
    for (const runlog::RangeRow& range : run.ranges) {
      if (range.frame != frame.frame || !range.bearing_rad) continue;
      Json mark{{"landmark", range.landmark}, {"bearing_rad", *range.bearing_rad}};
      if (range.range_m) mark["range_m"] = *range.range_m;
      json["marks"].push_back(std::move(mark));
    }
    panoramas.push_back(std::move(json));
  }
  return panoramas;
}

}  // namespace twocone::report
