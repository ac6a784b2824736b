// SPDX-License-Identifier: Apache-2.0
#include "apps/files/text_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include "apps/files/file_error.h"

namespace twocone::files {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) throw FileError(fmt::format("{}: no such file", file.string()));
  if (error) throw FileError(fmt::format("{}: cannot be read: {}", file.string(), error.message()));
  if (fs::is_directory(status)) throw FileError(fmt::format("{}: is a folder, must be a file", file.string()));
  if (!fs::is_regular_file(status)) throw FileError(fmt::format("{}: is not a regular file", file.string()));

  const auto refuse = [&] {
    const int why = errno;  // before format() can change it
    return FileError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(why)));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!stream) throw refuse();
  std::string text;
  char block[1 << 14];
  while (const std::size_t count = std::fread(block, 1, sizeof block, stream.get())) text.append(block, count);
  if (std::ferror(stream.get())) throw refuse();
  return text;
}

fs::path resolve(const fs::path& path, const fs::path& file) {
  const fs::path joined = file.parent_path() / path;  // an absolute path replaces the folder
  const fs::path folded = joined.lexically_normal();
  std::error_code error;
  return fs::exists(joined, error) && !fs::equivalent(joined, folded, error) ? joined : folded;
}

}  // namespace twocone::files
