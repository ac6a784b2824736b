// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

/// What each pixel of a simulated image shows, for judging an answer of the vision. The native renderer supplies it.
namespace twocone::sim_povray {

/// A box along the world's axes.
struct TrueBox {
  std::array<double, 3> low_m{}, high_m{};
};

/// An object of the scene, as its text describes it. The parts of a union count as objects of their own.
struct TrueObject {
  std::uint16_t number = 0;  ///< in PixelTruth::object; > 0
  std::string kind{};        ///< POV-Ray's keyword: "box", "cylinder", "difference"
  std::string name{};        ///< `//*PMName` of the block that it is or belongs to; empty: none
  std::string file{};        ///< where its statement begins; that of a macro or declaration is in its body
  int line = 0;
  std::optional<TrueBox> box{};  ///< holds it; none for what moves or is infinite
};

/// What the rays through the pixels' centres meet, row by row.
///
/// A ray that meets the robot's own mirror (a surface that moves with the camera's robot and reflects at least half of
/// the light) is followed once more, from the reflection point. What is behind any other mirror does not count. Each
/// vector has width_px * height_px entries.
struct PixelTruth {
  int width_px = 0, height_px = 0;
  std::vector<std::uint16_t> object{};  ///< TrueObject::number; 0: nothing is met, and the other entries are 0
  /// From the reflection point on the robot's own mirror, or from the camera if the pixel does not show that mirror, to
  /// the point that is met.
  std::vector<float> distance_m{};
  /// Of the surface there, in the world's frame, of length 1, on the side that is seen.
  std::vector<std::array<float, 3>> normal{};
  std::shared_ptr<const std::vector<TrueObject>> objects{};  ///< of the whole scene, by number; equal for all images
};

/// Receives the truth of one image.
using TruthReceiver = std::function<void(PixelTruth)>;

}  // namespace twocone::sim_povray
