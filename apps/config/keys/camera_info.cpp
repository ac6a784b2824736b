// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/robot_keys.h"

#include <algorithm>

namespace twocone::config {
namespace {

constexpr Range kSide{.least = 1, .greatest = 16384};
constexpr const char* kUnused[] = {"camera_name", "rectification_matrix", "projection_matrix", "binning_x", "binning_y",
                                   "roi"};

void read_size(Section& root, std::string_view key, std::string_view what, int wanted_px, const std::string& camera) {
  int size_px = 0;
  if (root.whole(key, {what, kPixels, kSide}, size_px) && size_px != wanted_px) {
    root.complain(key, kPixels, fmt::format("{}, that of {}", wanted_px, camera));
  }
}

/// Reads the number of rows or columns, which may be absent.
void read_count(Section& matrix, std::string_view key, std::string_view what, int wanted) {
  int count = wanted;
  if (matrix.whole(key, {what, kNoUnit, kAboveZero}, count, Need::kOptional) && count != wanted) {
    matrix.complain(key, kNoUnit, fmt::format("{}", wanted));
  }
}

/// Reads a ROS matrix, which has rows, cols and the numbers row by row.
Section* read_matrix(Section& root, std::string_view key, std::string_view what, int rows) {
  Section* matrix = root.section(key, what);
  if (matrix != nullptr) read_count(*matrix, "rows", "rows of the matrix", rows);
  return matrix;
}

void read_camera_matrix(Section& root, RigView& view) {
  Section* matrix = read_matrix(root, "camera_matrix", "{rows: 3, cols: 3, data: [fx, 0, cx, 0, fy, cy, 0, 0, 1]}", 3);
  if (matrix == nullptr) return;
  read_count(*matrix, "cols", "columns of the matrix", 3);
  std::array<double, 9> k{};
  if (!matrix->numbers("data", {"fx, 0, cx, 0, fy, cy, 0, 0, 1", kPixels, kAnyNumber}, k)) return;
  const bool is_camera = k[0] > 0 && k[1] == 0 && k[3] == 0 && k[4] > 0 && k[6] == 0 && k[7] == 0 && k[8] == 1;
  if (!is_camera) {
    matrix->complain("data", kNoUnit, "[fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx and fy > 0 (pixels)");
    return;
  }
  view.distortion_focal_px = {k[0], k[4]};
  view.distortion_principal_px = {k[2], k[5]};
}

void read_distortion(Section& root, RigView& view) {
  std::string model = "plumb_bob";
  const bool has_model = root.text("distortion_model", "the lens model", model, Need::kOptional);
  const bool is_rational = model == "rational_polynomial";
  if (has_model && !is_rational && model != "plumb_bob") {
    root.complain("distortion_model", kNoUnit, "plumb_bob or rational_polynomial");
  }
  Section* matrix = read_matrix(root, "distortion_coefficients", "{rows: 1, cols: 5, data: [k1, k2, p1, p2, k3]}", 1);
  if (matrix == nullptr) return;
  constexpr std::size_t kCounts[] = {0, 4, 5, 8};
  const std::span counts(kCounts, is_rational ? 4 : 3);  // only rational_polynomial may have eight coefficients
  const Quantity quantity{is_rational ? "k1 k2 p1 p2 k3 k4 k5 k6" : "k1 k2 p1 p2 [k3]", kNoUnit, kAnyNumber};
  const bool is_good = matrix->number_list("data", quantity, counts, view.distortion);
  std::optional<int> columns;
  matrix->whole("cols", {"columns of the matrix", kNoUnit, kZeroOrMore}, columns);
  if (columns && is_good && std::size_t(*columns) != view.distortion.size()) {
    matrix->complain("cols", kNoUnit, fmt::format("{}, as many as data has", view.distortion.size()));
  }
  const bool is_none = std::ranges::all_of(view.distortion, [](double k) { return k == 0; });
  if (is_none) view.distortion.clear();
}

}  // namespace

void read_camera_info(const drivers::CameraPart& camera, const std::string& name, RigView& view) {
  Reading reading(load_yaml(view.camera_info), view.camera_info);
  Section& root = reading.root();
  read_size(root, "image_width", "width of the image", camera.settings.width_px, name);
  read_size(root, "image_height", "height of the image", camera.settings.height_px, name);
  read_camera_matrix(root, view);
  read_distortion(root, view);
  for (const char* const key : kUnused) root.has(key);
  reading.finish();
  if (!view.distortion.empty()) return;
  view.distortion_focal_px.reset();
  view.distortion_principal_px.reset();
}

}  // namespace twocone::config
