// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/overhead.h"

#include <cmath>
#include <system_error>

#include <fmt/format.h>

#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "drivers/sim_povray/scene_views.h"

namespace twocone::report {
namespace {

constexpr int kOverheadWidth_px = 1000;
constexpr int kOverheadQuality = 82;

bool fits(const Image& image, const config::Bounds& bounds) {
  const double wanted = (bounds.max_x_m - bounds.min_x_m) / (bounds.max_y_m - bounds.min_y_m);
  // A difference of one pixel in either direction is rounding.
  return std::abs(image.width_px - wanted * image.height_px) <= 1 + wanted;
}

/// Errors: kNotFound (no scene), kUnavailable (the disk), those of sim_povray::render_overhead.
Result<Image> rendered_or_kept(const config::Map& map, const std::filesystem::path& cache) {
  if (!map.scene) return Error{ErrorCode::kNotFound, "the map names no scene"};
  if (auto kept = runlog::read_image(cache); kept && fits(*kept, map.bounds)) return kept;
  const config::Bounds& b = map.bounds;
  if (!(b.min_x_m < b.max_x_m && b.min_y_m < b.max_y_m)) return Error{ErrorCode::kNotFound, "the map has no extent"};
  sim_povray::OverheadView view{b.min_x_m, b.max_x_m, b.min_y_m, b.max_y_m};
  view.width_px = kOverheadWidth_px;
  Result<Image> rendered = sim_povray::render_overhead(*map.scene, map.unit_m, view, {}, map.scene_paths);
  if (!rendered) return rendered;
  std::error_code ignored;  // then the image cannot be written either
  std::filesystem::create_directories(cache.parent_path(), ignored);
  try {
    runlog::write_image(cache, *rendered);
  } catch (const runlog::DiskError& error) {
    return Error{ErrorCode::kUnavailable, error.what()};
  }
  return rendered;
}

}  // namespace

std::optional<std::string> overhead_uri(const std::filesystem::path& folder, const config::Map& map,
                                        std::string_view what_is, std::vector<std::string>& notes) {
  const Result<Image> image = rendered_or_kept(map, folder / "overhead.png");
  if (image) return runlog::jpeg_uri(*image, kOverheadQuality);
  notes.push_back(fmt::format("{} drawn over a plan instead of an image of the arena from above: {}", what_is,
                              image.error().message));
  return std::nullopt;
}

}  // namespace twocone::report
