// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/confined_povray.h"

#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/log.h"
#include "drivers/sim_povray/effects.h"

namespace twocone::sim_povray {
namespace {

/// Refuses a string of the scene that names a file which the scene may not read. It does not find names that the scene
/// puts together.
Status check_named_files(const SceneCalls& calls, const SceneAccess& access) {
  for (const WrittenString& string : calls.strings) {
    const std::filesystem::path file = string.text.empty() ? std::filesystem::path() : access.find(string.text);
    if (file.empty() || access.may_read(file)) continue;
    return Error{ErrorCode::kRefused, fmt::format("{}:{}: {}", string.file, string.line, SceneAccess::refusal(file))};
  }
  return {};
}

}  // namespace

Result<Povray> confined_povray(const PlaceSettings& place, const SceneCalls& calls) {
  auto program = find_povray(place.render.povray);
  if (!program) return program.error();
  for (const std::filesystem::path& folder : place.scene_paths) {
    std::error_code error;
    if (std::filesystem::is_directory(folder, error)) continue;
    return Error{ErrorCode::kNotFound, fmt::format("scene_paths names no folder: {}", folder.string())};
  }
  auto access = std::make_shared<SceneAccess>(place.scene, place.scene_paths);
  for (const std::string& folder : calls.folders) access->look_in(folder);
  std::vector<std::string> readable = needed_to_run(*program);
  for (const std::filesystem::path& folder : access->readable()) readable.push_back(folder.string());
  auto confinement = std::make_shared<const base::Confinement>(std::move(readable), place.render.landlock);
  if (confinement->kind() != base::Confinement::Kind::kLandlock) {
    base::Logger("povray").warning(describe_confinement(place));
    if (auto inside = check_named_files(calls, *access); !inside) return inside.error();
  }
  return Povray(*std::move(program), place.scene, place.render.timeout, {std::move(confinement), std::move(access)});
}

Result<Povray> confined_povray(const PlaceSettings& place, const Scene& scene) {
  return confined_povray(place, find_calls(scene, SceneAccess(place.scene, place.scene_paths)));
}

std::string describe_confinement(const PlaceSettings& place) {
  const SceneAccess access(place.scene, place.scene_paths);
  std::vector<std::string> folders;
  for (const std::filesystem::path& folder : access.readable()) folders.push_back(folder.string());
  switch (base::Confinement({}, place.render.landlock).kind()) {
    case base::Confinement::Kind::kLandlock:
      return fmt::format(
          "POV-Ray is confined by the kernel (Landlock, version {}): it reads {} and its libraries, and writes nothing "
          "but its images",
          base::landlock_version(), fmt::join(folders, ", "));
    case base::Confinement::Kind::kNoWriting:
      return fmt::format(
          "POV-Ray is confined in part (this kernel has no Landlock): it can write no file (seccomp); a file that the "
          "scene names in its text must be in {} or POV-Ray's libraries, but a name that the scene puts together is "
          "not checked",
          fmt::join(folders, ", "));
    case base::Confinement::Kind::kNone:
      break;
  }
  return "POV-Ray is not confined: this kernel has no Landlock, and there is no seccomp filter for this processor: "
         "render scenes that you trust only";
}

}  // namespace twocone::sim_povray
