// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sim_povray/render/native/bvh.h"
#include "drivers/sim_povray/render/native/shapes.h"
#include "drivers/sim_povray/scene/evaluated_scene.h"

namespace twocone::sim_povray {

/// Poses of one image: how each block of the scene has moved from where the scene shows it.
struct Poses {
  std::vector<Transform> movers{};
  Transform view{};

  [[nodiscard]] const Transform& of(int mover) const;
};

/// An evaluated scene prepared for tracing: top-level unions are taken apart, and what moves together is one group with
/// hierarchies of its own, so that nothing is rebuilt when it moves.
class TracedScene {
 public:
  struct Item {
    TracedSolid solid;
    const Texture* texture;  ///< of what has none of its own
    int number;              ///< in the order of the scene; of two surfaces at one place the first is seen
    bool casts_shadow;
    bool in_image;       ///< seen by the camera
    bool in_reflection;  ///< seen in mirrors
    Bounds3 bounds;      ///< of what is not infinite
    bool is_box;         ///< it is the box `bounds` and nothing else
    const Texture* box_texture;
  };
  struct Group {
    int mover = -1;
    std::vector<Item> items{};
    Bvh bounded{};  ///< over those of `items` that `bounded_items` lists
    std::vector<int> bounded_items{};
    std::vector<int> unbounded{};  ///< planes and other infinite shapes
    Bvh shadows{};                 ///< over `shadow_items`
    std::vector<int> shadow_items{};
    std::vector<int> unbounded_shadows{};
  };

  explicit TracedScene(EvaluatedScene scene);

  [[nodiscard]] const EvaluatedScene& scene() const { return scene_; }
  [[nodiscard]] const std::vector<Group>& groups() const { return groups_; }
  struct Place {
    int group, item;
  };
  /// Returns where an item stands. @param number Item::number
  [[nodiscard]] const Place& place(int number) const { return places_[std::size_t(number)]; }
  /// What an item is in the scene's text.
  struct Source {
    const char* kind;  ///< POV-Ray's keyword
    std::string name;  ///< of the named block that it is or belongs to; empty: none
    std::shared_ptr<const std::string> file;
    int line;
  };
  /// Returns the sources of all items, by Item::number.
  [[nodiscard]] const std::vector<Source>& sources() const { return sources_; }

 private:
  void add(const Object& object, int mover);

  EvaluatedScene scene_;
  std::vector<Group> groups_;
  std::vector<Place> places_;
  std::vector<Source> sources_;
};

/// Measured: POV-Ray sees no surface nearer than this to where a ray starts, and none nearer than the other number to
/// either end of the way from a surface to a light casts a shadow.
constexpr double kNearest = 1e-4;
constexpr double kNearestShadow = 1e-3;

/// A scene with the poses of one image, and what follows from them.
class PosedScene {
 public:
  /// @param scene must outlive this
  PosedScene(const TracedScene& scene, Poses poses);

  struct Group {
    Transform to_group;  ///< from the scene's coordinates
    /// Around all that can be seen of the group, and around all that casts shadows, in the scene's coordinates; none if
    /// that is infinite. A group without such things has an empty box, which no ray meets.
    std::optional<Bounds3> seen{}, shadows{};
  };

  [[nodiscard]] const TracedScene& scene() const { return scene_; }
  [[nodiscard]] const Poses& poses() const { return poses_; }
  /// Returns a group's, by its index in TracedScene::groups().
  [[nodiscard]] const Group& group(std::size_t index) const { return groups_[index]; }
  /// Returns the lights where they are in this image.
  [[nodiscard]] const std::vector<LightSource>& lights() const { return lights_; }

 private:
  const TracedScene& scene_;
  Poses poses_;
  std::vector<Group> groups_{};
  std::vector<LightSource> lights_{};
};

/// Returns a box around the image of a box.
Bounds3 moved(const Bounds3& box, const Transform& by);

enum class RayKind { kFromCamera, kReflected };

/// A set of groups, as bits of their indices. Groups from kGroupBits on are in every set.
using GroupSet = std::uint64_t;
constexpr std::size_t kGroupBits = 64;
constexpr GroupSet kAllGroups = ~GroupSet{0};

/// A point of a surface that a ray meets.
struct Meeting {
  double t = 0;
  const TracedScene::Group* group = nullptr;
  const Texture* texture = nullptr;
  Vec3 point{};          ///< in the scene's coordinates
  Vec3 pattern_point{};  ///< in those of the group, where pigments are defined
  Vec3 normal{};         ///< in the scene's coordinates, of length 1, towards either side
  int number = 0;        ///< Item::number of what is met
};

/// Returns the nearest surface of the groups in `which` along a ray of length-1 direction, nearer than `t_max`. Two
/// surfaces at one place: the first in the scene.
std::optional<Meeting> nearest(const TracedScene& scene, const Poses& poses, const Ray& ray, RayKind kind,
                               GroupSet which = kAllGroups, double t_max = kInfinity);
/// Returns the colour that a ray that meets nothing brings.
Colour sky_colour(const EvaluatedScene& scene, const Vec3& direction);

}  // namespace twocone::sim_povray
