// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/scene_files.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/text_file.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

std::string digest_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325;  // offset basis and prime of FNV-1a
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

class SceneFiles {
 public:
  explicit SceneFiles(const config::Map& map) : folders_(map.scene_paths) {
    folders_.push_back(fs::absolute(*map.scene).lexically_normal().parent_path());
    add(*map.scene);
  }
  [[nodiscard]] const std::map<std::string, std::string>& digests() const { return digests_; }

 private:
  void add(const fs::path& path) {
    const fs::path file = fs::absolute(path).lexically_normal();
    std::error_code none;
    if (!fs::is_regular_file(file, none) || digests_.contains(file.string())) return;
    std::string text;
    try {
      text = config::read_text(file);
    } catch (const config::FileError&) {
      return;
    }
    digests_[file.string()] = digest_of(text);
    if (file.extension() == ".pov" || file.extension() == ".inc") add_named_in(text);
  }

  /// Includes names in comments. An unneeded file does no harm.
  void add_named_in(const std::string& text) {
    for (std::size_t open = text.find('"'); open != std::string::npos;) {
      const std::size_t close = text.find('"', open + 1);
      if (close == std::string::npos) return;
      const std::string_view name = std::string_view(text).substr(open + 1, close - open - 1);
      // A single quotation mark, for example in a comment, must not hide the names after it.
      const bool is_name = !name.empty() && name.size() < 256 && name.find('\n') == std::string_view::npos;
      for (const fs::path& folder : folders_) {
        if (is_name) add(folder / name);
      }
      open = is_name ? text.find('"', close + 1) : close;
    }
  }

  std::vector<fs::path> folders_;
  std::map<std::string, std::string> digests_;
};

}  // namespace

std::vector<SourceFile> scene_files(const config::Map& map) {
  std::vector<SourceFile> sources;
  const SceneFiles files(map);
  for (const auto& [file, digest] : files.digests()) sources.push_back({file, digest});
  return sources;
}

}  // namespace twocone::runlog
