// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim_povray/render/native/traced_scene.h"
#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene_text.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Parses a RenderJob::pose. Nothing if it is not of the form that Scene::pose_text() writes.
std::optional<Poses> parse_poses(std::string_view pose_text);

/// Renders the images of one view. May be used by several threads at once.
///
/// Rays from the camera to the robot's own mirror, and what the mirror reflects them to, are fixed in the robot's frame
/// and found once. An image then follows only the reflected rays, unless something has come between camera and mirror.
class NativeView {
 public:
  /// @param path of the scene, for messages @param read obeys what the scene may read
  /// Errors: kRefused: the scene needs POV-Ray; the message has file, line and keyword.
  static Result<std::shared_ptr<const NativeView>> make(const ViewTemplate& view_template, const std::string& path,
                                                        const IncludeReader& read);

  /// Renders some of the image's rows of tiles into an image of the view's size, which is black at first.
  /// @param band from 0 to below bands()
  void render(const Poses& poses, int band, Image& image) const;
  [[nodiscard]] int bands() const { return int(bands_.size()); }
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  /// What a pixel shows that does not change while only the robot moves.
  struct FixedPixel {
    enum class Kind : std::uint8_t {
      kAny,       ///< nothing is known
      kConstant,  ///< `colour`
      kMirror,    ///< `colour`, and `share` of what the reflected ray meets
    };
    Kind kind = Kind::kAny;
    bool meets_own = false;  ///< the reflected ray meets the robot itself at own_t
    Colour colour{}, share{};
    Ray reflected{};  ///< in the coordinates in which the scene shows the robot
    double own_t = kInfinity;
  };

  NativeView(EvaluatedScene scene, const ViewTemplate& view_template);

  [[nodiscard]] Ray camera_ray(double column, double row) const;
  [[nodiscard]] FixedPixel fixed_pixel(const Ray& ray);
  void plan();
  [[nodiscard]] bool is_view_clear(const Poses& poses) const;

  TracedScene scene_;
  int width_px_, height_px_;
  Window window_;
  GroupSet own_ = 0;  ///< the robot and what moves with the view
  int robot_ = -1;    ///< the mover that moves as the view does
  std::vector<FixedPixel> fixed_{};
  Bounds3 sight_{};           ///< holds the rays from the camera to fixed pixels
  std::vector<int> bands_{};  ///< first rows
};

}  // namespace twocone::sim_povray
