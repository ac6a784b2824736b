// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/rig_keys.h"

#include <array>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/text_file.h"

namespace twocone::config {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;
/// The range is wide because an angle may be given as 3/4 or as -1/4 of a turn. A value in degrees is still noticed.
constexpr Range kWithinATurn{.least = -kTurn_rad, .greatest = kTurn_rad, .words = "-2 pi to 2 pi"};
constexpr Range kApexRange{.least = 0, .greatest = std::numbers::pi, .without_ends = true, .words = "> 0 and < pi"};
constexpr Range kTiltRange{.least = -std::numbers::pi / 4,
                           .greatest = std::numbers::pi / 4,
                           .without_ends = true,
                           .words = "> -pi/4 and < pi/4"};

bool read_mirror(Section& where, RigView& view) {
  Section* mirror = where.section("mirror", "{type: cone, apex_rad}");
  if (mirror == nullptr) return false;
  std::string type;
  if (mirror->text("type", "the mirror's shape, cone", type) && type != "cone") {
    mirror->complain("type", kNoUnit, "cone");
  }
  return mirror->number("apex_rad", {"full angle of the cone", kRadians, kApexRange}, view.apex_rad);
}

/// A key of a mirror. In `rig:` it applies to both, in `rig.lower:` or `rig.upper:` to one and overrides `rig:`.
struct MirrorKey {
  const char* key;
  Quantity quantity;
  Need need;
  bool (*read)(Section&, const MirrorKey&, RigView&);
};

template <double RigView::*kMember>
bool read_number(Section& where, const MirrorKey& key, RigView& view) {
  return where.number(key.key, key.quantity, view.*kMember);
}

template <std::array<double, 2> RigView::*kMember>
bool read_pair(Section& where, const MirrorKey& key, RigView& view) {
  return where.numbers(key.key, key.quantity, view.*kMember);
}

const MirrorKey kMirrorKeys[] = {
    {"mirror",
     {"{type: cone, apex_rad}", kNoUnit, kAnyNumber},
     Need::kRequired,
     [](Section& where, const MirrorKey&, RigView& view) { return read_mirror(where, view); }},
    {"mirror_radius_m",
     {"radius R of the mirror's rim", kMetres, kPartLength},
     Need::kRequired,
     read_number<&RigView::mirror_radius_m>},
    {"lens_to_tip_m",
     {"distance d from the lens to the mirror's tip", kMetres, kPartLength},
     Need::kRequired,
     read_number<&RigView::lens_to_tip_m>},
    {"centre_px",
     {"column and row of the mirror's tip in the image", kPixels, kAnyNumber},
     Need::kRequired,
     read_pair<&RigView::centre_px>},
    {"rim_radius_px",
     {"radius of the mirror's rim in the image", kPixels, kAboveZero},
     Need::kRequired,
     read_number<&RigView::rim_radius_px>},
    {"azimuth_rad",
     {"bearing of the image's x axis", kRadians, kWithinATurn},
     Need::kRequired,
     read_number<&RigView::azimuth_rad>},
    {"mirrored",
     {"whether the image turns against the bearing", kNoUnit, kAnyNumber},
     Need::kOptional,
     [](Section& where, const MirrorKey& key, RigView& view) {
       return where.flag(key.key, key.quantity.what, view.mirrored);
     }},
    {"tilt_rad",
     {"turns about the body's x and y axes", kRadians, kTiltRange},
     Need::kOptional,
     read_pair<&RigView::tilt_rad>},
    {"axis_offset_m",
     {"x and y of the lens in the body's frame", kMetres, kAnyNumber},
     Need::kOptional,
     read_pair<&RigView::axis_offset_m>},
};

/// One of the two mirrors.
struct MirrorPart {
  const char* key;  ///< of its section in `rig:`
  const char* what;
  RigView* view;
  Section* section = nullptr;    ///< null: absent or unreadable
  bool is_absent = false;        ///< the file has no such section
  std::string absent_keys = {};  ///< keys that the missing section would need
};

/// Complains if a mirror has `key` neither itself nor in common. If both lack it, there is one complaint.
void complain_missing(const MirrorKey& key, Section& rig, std::span<MirrorPart> mirrors) {
  std::vector<MirrorPart*> lacking;
  for (MirrorPart& mirror : mirrors) {
    if (mirror.is_absent || (mirror.section != nullptr && !mirror.section->has(key.key))) lacking.push_back(&mirror);
  }
  if (lacking.size() == mirrors.size()) {
    rig.complain_missing(key.key, fmt::format("{}, here for both mirrors or in lower and in upper", key.quantity.what),
                         key.quantity.unit);
    return;
  }
  for (MirrorPart* mirror : lacking) {
    if (mirror->section != nullptr) {
      mirror->section->complain_missing(key.key, key.quantity.what, key.quantity.unit);
    } else {
      mirror->absent_keys += fmt::format("{}{}", mirror->absent_keys.empty() ? "" : ", ", key.key);
    }
  }
}

/// Reads the keys of the lens, which belong together. A mirror's own `distortion` or `camera_info` replaces both keys
/// of `rig:`. @param is_distortion_common whether `rig:` sets `distortion` for both mirrors
void read_lens(Section& where, const std::filesystem::path& file, bool is_distortion_common, RigView& view) {
  const bool has_distortion = where.has("distortion");
  const bool has_file = where.has("camera_info");
  constexpr std::size_t kCounts[] = {0, 4, 5, 8};
  if (has_distortion) {
    view.camera_info.clear();
    where.number_list("distortion", {"k1 k2 p1 p2 [k3 [k4 k5 k6]]", kNoUnit, kAnyNumber}, kCounts, view.distortion);
  }
  if (has_file) {
    std::string name;
    if (where.text("camera_info", "the camera's calibration", name)) view.camera_info = resolve(name, file);
    if (has_distortion) {
      where.complain("camera_info", kNoUnit, "absent beside distortion");
    } else {
      view.distortion.clear();
      view.distortion_focal_px.reset();
      view.distortion_principal_px.reset();
    }
  }
  const auto keep = [&](std::string_view key, Unit unit, bool is_good, const std::array<double, 2>& pair,
                        std::optional<std::array<double, 2>>& value) {
    if (is_good) value = pair;
    if (!has_distortion && (has_file || !is_distortion_common)) where.complain(key, unit, "absent without distortion");
  };
  std::array<double, 2> pair{};
  if (constexpr auto kKey = "distortion_focal_px"; where.has(kKey)) {
    const bool is_good =
        where.number_or_pair(kKey, {"focal lengths that the distortion is for", kPixels, kAboveZero}, pair);
    keep(kKey, kPixels, is_good, pair, view.distortion_focal_px);
  }
  if (constexpr auto kKey = "distortion_principal_px"; where.has(kKey)) {
    const bool is_good =
        where.numbers(kKey, {"column and row that the distortion is about", kPixels, kAnyNumber}, pair);
    keep(kKey, kPixels, is_good, pair, view.distortion_principal_px);
  }
}

}  // namespace

void read_rig(Section& root, const std::filesystem::path& file, Rig& rig) {
  Section* section = root.section("rig", "the two mirrors as the robot believes them to be");
  if (section == nullptr) return;
  section->number("mirror_separation_m", {"distance s between the two mirrors' tips", kMetres, kAboveZero},
                  rig.mirror_separation_m);
  section->number("lens_height_m", {"lower lens above the floor", kMetres, kZeroOrMore}, rig.lens_height_m);

  RigView common;
  for (const MirrorKey& key : kMirrorKeys) {
    if (section->has(key.key)) key.read(*section, key, common);
  }
  read_lens(*section, file, false, common);
  MirrorPart mirrors[] = {{"lower", "the lower mirror, with its", &rig.lower},
                          {"upper", "the upper mirror, with its", &rig.upper}};
  for (MirrorPart& mirror : mirrors) {
    *mirror.view = common;
    mirror.is_absent = !section->has(mirror.key);
    mirror.section = section->section(mirror.key, mirror.what, Need::kOptional);
    if (mirror.section == nullptr) continue;
    for (const MirrorKey& key : kMirrorKeys) {
      if (mirror.section->has(key.key)) key.read(*mirror.section, key, *mirror.view);
    }
    read_lens(*mirror.section, file, section->has("distortion"), *mirror.view);
  }
  for (const MirrorKey& key : kMirrorKeys) {
    if (key.need == Need::kRequired && !section->has(key.key)) complain_missing(key, *section, mirrors);
  }
  for (const MirrorPart& mirror : mirrors) {
    if (!mirror.absent_keys.empty()) {
      section->complain_missing(mirror.key, fmt::format("{} {}", mirror.what, mirror.absent_keys));
    }
  }
}

void set_camera_info_paths(YAML::Node& robot, const std::filesystem::path& file, const PathChange& change) {
  constexpr const char* kKey = "camera_info";
  const auto set = [&](YAML::Node where) {
    if (where.IsMap() && where[kKey]) where[kKey] = change(resolve(where[kKey].as<std::string>(), file)).string();
  };
  YAML::Node rig = robot["rig"];
  set(rig);
  for (const char* const mirror : {"lower", "upper"}) {
    if (rig[mirror]) set(rig[mirror]);
  }
}

}  // namespace twocone::config
