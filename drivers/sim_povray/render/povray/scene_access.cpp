// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/scene_access.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone::sim_povray {
namespace {

namespace fs = std::filesystem;

/// POV-Ray accepts 25 Library_Path at most; its own settings name three.
constexpr std::size_t kMostExtraFolders = 20;

constexpr std::array kFonts{"/usr/share/fonts", "/usr/local/share/fonts"};

fs::path real(const fs::path& path) {
  std::error_code error;
  fs::path result = fs::weakly_canonical(fs::absolute(path), error);
  if (error) result = fs::absolute(path).lexically_normal();
  // "a/" gives the same result as "a".
  return result.has_filename() ? result : result.parent_path();
}

bool lies_below(const fs::path& file, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
}

std::vector<fs::path> library_folders() {
  std::vector<fs::path> folders;
  std::ifstream file(system_ini());
  for (std::string line; std::getline(file, line);) {
    constexpr std::string_view kKey = "Library_Path";
    const auto value = line.find('=');
    if (!line.starts_with(kKey) || value == std::string::npos) continue;
    std::string folder = line.substr(value + 1);
    std::erase_if(folder, [](char c) { return c == '"' || c == '\r'; });
    folder.erase(0, folder.find_first_not_of(" \t"));
    folder.erase(folder.find_last_not_of(" \t") + 1);
    if (!folder.empty()) folders.emplace_back(folder);
  }
  for (const char* usual : {"/usr/share/povray-3.7/include", "/usr/local/share/povray-3.7/include"}) {
    folders.emplace_back(usual);
  }
  return folders;
}

/// Returns the text between `begin` and `end`.
std::optional<std::string> between(std::string_view text, std::string_view begin, std::string_view end) {
  const auto from = text.find(begin);
  if (from == std::string_view::npos) return std::nullopt;
  const auto to = text.find(end, from + begin.size());
  if (to == std::string_view::npos) return std::nullopt;
  return std::string(text.substr(from + begin.size(), to - from - begin.size()));
}

/// POV-Ray adds the ending if there is none.
constexpr std::array kEndings{"", ".inc", ".INC", ".pov", ".POV", ".ttf", ".png", ".jpg", ".gif", ".tga", ".df3"};

std::optional<IncludedFile> read_from(const SceneAccess& access, const std::string& name) {
  std::optional<IncludedFile> refused;
  for (const fs::path& folder : access.searched()) {
    // POV-Ray adds the ending if there is none.
    for (const char* ending : {"", ".inc", ".INC"}) {
      const fs::path path = folder / (name + ending);
      std::error_code error;
      if (!access.may_read(path)) {
        if (!refused && fs::is_regular_file(path, error)) {
          refused = IncludedFile{.path = path.string(), .text = {}, .refusal = SceneAccess::refusal(path)};
        }
        continue;
      }
      if (fs::is_directory(path, error)) return IncludedFile{path.string(), {}, true};
      if (!fs::is_regular_file(path, error) || fs::file_size(path, error) > kMostIncludedBytes) continue;
      std::ifstream file(path, std::ios::binary);
      std::string text{std::istreambuf_iterator<char>(file), {}};
      if (file) return IncludedFile{path.string(), std::move(text), false};
    }
  }
  return refused;
}

}  // namespace

IncludeReader include_reader(SceneAccess& access) {
  return [&access](const std::string& name) {
    auto found = read_from(access, name);
    // An included file may name files beside it.
    if (found && found->refusal.empty()) access.look_in(fs::path(found->path).parent_path());
    return found;
  };
}

std::string system_ini() {
  for (const char* ini : {"/etc/povray/3.7/povray.ini", "/usr/local/etc/povray/3.7/povray.ini"}) {
    if (::access(ini, R_OK) == 0) return ini;
  }
  return {};
}

std::vector<std::string> needed_to_run(const std::string& program) {
  std::vector<std::string> paths{program};
  paths.insert(paths.end(), {"/lib", "/lib32", "/lib64", "/usr/lib", "/usr/lib32", "/usr/lib64", "/usr/local/lib"});
  paths.insert(paths.end(), {"/etc/ld.so.cache", "/etc/ld.so.preload", "/etc/povray", "/usr/local/etc/povray"});
  paths.insert(paths.end(), {"/etc/fonts", "/usr/share/povray-3.7", "/usr/local/share/povray-3.7"});
  paths.insert(paths.end(), {"/sys/devices/system/cpu"});
  paths.insert(paths.end(), kFonts.begin(), kFonts.end());
  for (const fs::path& folder : library_folders()) paths.push_back(folder.string());
  // For a POV-Ray that is installed somewhere else: PREFIX/bin/povray.
  const fs::path folder = fs::path(program).parent_path();
  if (folder.filename() == "bin" && folder.parent_path().has_filename()) {
    for (const char* part : {"lib", "etc/povray", "share/povray-3.7"}) {
      paths.push_back((folder.parent_path() / part).string());
    }
  }
  if (const char* extra = std::getenv("LD_LIBRARY_PATH"); extra != nullptr) {
    std::istringstream folders(extra);
    for (std::string each; std::getline(folders, each, ':');) {
      if (!each.empty()) paths.push_back(each);
    }
  }
  return paths;
}

SceneAccess::SceneAccess(const fs::path& scene, const std::vector<fs::path>& scene_paths) {
  searched_.push_back(fs::absolute(scene).parent_path());
  for (fs::path& folder : library_folders()) searched_.push_back(std::move(folder));
  libraries_ = searched_.size() - 1;
  if (scene_paths.empty()) readable_.push_back(real(scene).parent_path().string());
  for (const fs::path& folder : scene_paths) {
    readable_.push_back(real(folder).string());
    look_in(readable_.back());
  }
}

bool SceneAccess::may_read(const fs::path& file) const {
  const fs::path there = real(file);
  const auto holds_it = [&there](const fs::path& folder) { return lies_below(there, real(folder)); };
  return std::any_of(readable_.begin(), readable_.end(), holds_it) ||
         std::any_of(searched_.begin() + 1, searched_.begin() + 1 + std::ptrdiff_t(libraries_), holds_it) ||
         std::any_of(kFonts.begin(), kFonts.end(), holds_it);
}

void SceneAccess::look_in(const fs::path& folder) {
  const fs::path there = real(folder);
  const auto same = [&there](const fs::path& known) { return real(known) == there; };
  if (std::any_of(searched_.begin(), searched_.end(), same) || !may_read(there)) return;
  if (searched_.size() < 1 + libraries_ + kMostExtraFolders) searched_.push_back(there);
}

std::vector<fs::path> SceneAccess::extra_folders() const {
  return {searched_.begin() + 1 + std::ptrdiff_t(libraries_), searched_.end()};
}

fs::path SceneAccess::find(const std::string& name) const {
  std::error_code error;
  for (const fs::path& folder : searched_) {
    for (const char* ending : kEndings) {
      fs::path path = folder / (name + ending);
      if (fs::is_regular_file(path, error)) return path;
    }
  }
  return {};
}

std::string SceneAccess::refusal(const fs::path& file) {
  const fs::path there = real(file);
  return fmt::format(
      "a scene may read the map's folder, its scene_paths and POV-Ray's libraries, and {} is in none of them; if it is "
      "to be read, add to the map: scene_paths: [{}]",
      there.string(), there.parent_path().string());
}

std::string SceneAccess::advice(std::string_view complaint) const {
  constexpr std::string_view kUserFile = "Cannot open user file ";
  for (const char* mode : {" (write)", " (append)"}) {
    if (const auto name = between(complaint, kUserFile, mode)) return "a scene may write no file";
  }
  auto name = between(complaint, "Cannot find file '", "'");
  if (!name) name = between(complaint, kUserFile, " (read)");
  if (!name && complaint.ends_with('.')) {
    constexpr std::string_view kInclude = "Cannot open include file ";
    if (const auto at = complaint.find(kInclude); at != std::string_view::npos) {
      name = std::string(complaint.substr(at + kInclude.size()));
      name->pop_back();
    }
  }
  if (!name || name->empty()) return {};
  const fs::path file = find(*name);
  if (!file.empty()) return may_read(file) ? std::string() : refusal(file);
  std::vector<std::string> folders{searched_.front().string()};
  for (const fs::path& folder : extra_folders()) folders.push_back(folder.string());
  return fmt::format(
      "looked for in {} and POV-Ray's libraries; if it is somewhere else, add that folder to the map: scene_paths: "
      "[FOLDER]",
      fmt::join(folders, ", "));
}

}  // namespace twocone::sim_povray
