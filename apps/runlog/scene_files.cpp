// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "base/hash.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

std::string digest_of(std::string_view bytes) { return fmt::format("{:016x}", base::fnv1a(bytes)); }

/// Returns the texts between quotation marks that may be names of files. Those in comments do no harm.
std::vector<std::string> quoted_in(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t open = text.find('"'); open != std::string::npos;) {
    const std::size_t close = text.find('"', open + 1);
    if (close == std::string::npos) break;
    std::string name = text.substr(open + 1, close - open - 1);
    // A single quotation mark, for example in a comment, must not hide the names after it.
    const bool is_name = !name.empty() && name.size() < 256 && name.find('\n') == std::string::npos;
    if (is_name) names.push_back(std::move(name));
    open = is_name ? text.find('"', close + 1) : close;
  }
  return names;
}

/// Adds a file, and those that it names in one of the folders.
void add(const fs::path& path, const std::vector<fs::path>& folders, FileDigests& digests) {
  const fs::path file = fs::absolute(path).lexically_normal();
  std::error_code none;
  if (!fs::is_regular_file(file, none) || digests.contains(file.string())) return;
  std::string text;
  try {
    text = config::read_text(file);
  } catch (const config::FileError&) {
    return;
  }
  digests[file.string()] = digest_of(text);
  if (file.extension() != ".pov" && file.extension() != ".inc") return;
  for (const std::string& name : quoted_in(text)) {
    for (const fs::path& folder : folders) add(folder / name, folders, digests);
  }
}

}  // namespace

FileDigests scene_files(const config::Map& map) {
  std::vector<fs::path> folders = map.scene_paths;
  folders.push_back(fs::absolute(*map.scene).lexically_normal().parent_path());
  FileDigests digests;
  add(*map.scene, folders, digests);
  return digests;
}

}  // namespace twocone::runlog
