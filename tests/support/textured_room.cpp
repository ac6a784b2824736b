// SPDX-License-Identifier: Apache-2.0
#include "tests/support/textured_room.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "vision/srgb.h"

namespace twocone::testing_support {
namespace {

/// Returns a random number from 0 to 1 for a corner of the texture's lattice.
double at_corner(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = std::uint64_t(x) * 0x9E3779B97F4A7C15U ^ std::uint64_t(y) * 0xC2B2AE3D27D4EB4FU ^
                    std::uint64_t(z) * 0x165667B19E3779F9U;
  h ^= h >> 31U;
  h *= 0xBF58476D1CE4E5B9U;
  h ^= h >> 29U;
  return double(h >> 11U) * 0x1p-53;
}

/// Returns smooth noise, 0 to 1.
double noise(const Eigen::Vector3d& p) {
  const Eigen::Vector3d corner = p.array().floor();
  const Eigen::Vector3d share = p - corner;
  const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
  double sum = 0;
  for (int k = 0; k < 8; ++k) {
    double weight = 1;
    std::array<std::int64_t, 3> at{};
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_next = (k >> axis & 1) != 0;
      const double t = smooth(share[axis]);
      weight *= is_next ? t : 1 - t;
      at[std::size_t(axis)] = std::int64_t(corner[axis]) + (is_next ? 1 : 0);
    }
    sum += weight * at_corner(at[0], at[1], at[2]);
  }
  return sum;
}

}  // namespace

Eigen::Vector3d TexturedRoom::met(const vision::Ray& ray) const {
  const auto slabs = [&](const Eigen::AlignedBox3d& box) {
    const Eigen::Array3d a = (box.min() - ray.origin_m).array() / ray.direction.array();
    const Eigen::Array3d b = (box.max() - ray.origin_m).array() / ray.direction.array();
    return std::pair(a.min(b).maxCoeff(), a.max(b).minCoeff());
  };
  double distance_m = slabs(walls).second;
  for (const Eigen::AlignedBox3d& box : boxes) {
    const auto [in_m, out_m] = slabs(box);
    if (in_m > 0 && in_m < out_m) distance_m = std::min(distance_m, in_m);
  }
  return ray.origin_m + distance_m * ray.direction;
}

double TexturedRoom::light(const Eigen::Vector3d& point) const {
  const double grains = slat_m > 0
                            ? 0.5 * std::sin(2 * std::numbers::pi * point.z() / slat_m)
                            : noise(point / cell_m) + noise(point / (4 * cell_m) + Eigen::Vector3d(7.3, 1.9, 4.1)) - 1;
  // Distances as the light of a lamp: a plain wall is not uniform.
  const double shading = 1 / (1 + 0.05 * point.squaredNorm());
  return std::clamp(0.35 * shading * (1 + contrast * grains), 0.0, 1.0);
}

vision::Ray in_world(const vision::Ray& ray, const Pose2& body) {
  const Eigen::AngleAxisd turn(body.heading_rad, Eigen::Vector3d::UnitZ());
  return {turn * ray.origin_m + Eigen::Vector3d(body.x_m, body.y_m, 0), turn * ray.direction};
}

cv::Mat image_of(const TexturedRoom& room, const vision::MirrorView& view, cv::Size size, const Pose2& body,
                 const RoomCamera& camera, std::mt19937_64& random) {
  cv::Mat image(size, CV_8UC3, cv::Scalar::all(0));
  std::normal_distribution<double> normal;
  const double read = camera.read_noise_electrons / camera.full_well_electrons;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      double light = 0;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2d pixel(column + (k % 2) * 0.5 - 0.25, row + (k / 2) * 0.5 - 0.25);
        if (const auto ray = view.back_project(pixel)) light += room.light(room.met(in_world(*ray, body))) / 4;
      }
      if (light == 0) continue;
      light *= camera.gain;
      auto& rgb = image.at<cv::Vec3b>(row, column);
      for (int k = 0; k < 3; ++k) {
        const double noisy = light + std::sqrt(light / camera.full_well_electrons + read * read) * normal(random);
        rgb[k] = cv::saturate_cast<std::uint8_t>(vision::linear_to_srgb(std::clamp(noisy, 0.0, 1.0)));
      }
    }
  }
  return image;
}

}  // namespace twocone::testing_support
