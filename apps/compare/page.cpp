// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/compare/compare.h"
#include "apps/compare/exhibits.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/report/kit/overhead.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/web/document.h"

namespace twocone::compare {
namespace {

using Json = nlohmann::ordered_json;

Json uri_of(const cv::Mat& image) {
  constexpr int kQuality = 85;
  return image.empty() ? Json() : Json(runlog::jpeg_uri(estimation::as_image(image), kQuality));
}

Json views_of(const std::array<ExhibitView, 2>& views) {
  Json json;
  for (const ExhibitView& view : views) {
    const auto& grey = view.mean_difference_grey;
    json[view.name()] = {{"simulated", uri_of(view.simulated)},
                         {"real", uri_of(view.real)},
                         {"simulated_strip", uri_of(view.simulated_strip)},
                         {"real_strip", uri_of(view.real_strip)},
                         {"difference", uri_of(view.difference)},
                         {"mean_difference_grey", grey ? Json(*grey) : Json()},
                         {"notes", view.notes}};
  }
  return json;
}

/// Returns the colours of the difference from the darkest to the brightest real image, as CSS.
Json difference_scale() {
  Json colours = Json::array();
  for (const int grey : {-kStrongestDifference_grey, 0, kStrongestDifference_grey}) {
    const cv::Vec3b c = difference_colour(grey);
    colours.push_back(fmt::format("rgb({},{},{})", c[0], c[1], c[2]));
  }
  return {{"strongest_grey", kStrongestDifference_grey}, {"colours", colours}};
}

}  // namespace

std::string page(const Comparison& comparison, const std::filesystem::path& folder) {
  Json json = Json::parse(to_json(comparison));
  json["page"] = "compare";
  json["difference_scale"] = difference_scale();
  for (std::size_t i = 0; i < comparison.exhibits.size(); ++i) {
    json["exhibits"][i]["views"] = views_of(read_images(comparison, comparison.exhibits[i]));
  }
  std::vector<std::string> notes;
  if (comparison.map.scene) {
    if (auto arena = report::overhead_uri(folder / "figures", comparison.map, "The paths are", notes)) {
      json["overhead"] = *std::move(arena);
    }
  }
  json["page_notes"] = notes;
  return web::document(json, fmt::format("twocone compare: {} against {}", comparison.simulated, comparison.real),
                       table(comparison));
}

}  // namespace twocone::compare
