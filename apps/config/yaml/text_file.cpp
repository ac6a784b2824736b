// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/text_file.h"

#include <cerrno>
#include <cstring>
#include <system_error>

namespace twocone::config {

namespace fs = std::filesystem;

namespace {

FileError unreadable(const fs::path& file) {
  const int why = errno;  // saved before format() can change it
  return FileError("{}: cannot be read: {}", file.string(), std::strerror(why));
}

std::ifstream open(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) throw FileError("{}: no such file", file.string());
  if (error) throw FileError("{}: cannot be read: {}", file.string(), error.message());
  if (fs::is_directory(status)) throw FileError("{}: is a folder, must be a file", file.string());
  if (!fs::is_regular_file(status)) throw FileError("{}: is not a regular file", file.string());
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw unreadable(file);
  return stream;
}

}  // namespace

std::string read_text(const fs::path& file) {
  std::ifstream stream = open(file);
  std::string text;
  while (stream) {
    char block[1 << 14];
    stream.read(block, sizeof block);
    text.append(block, std::size_t(stream.gcount()));
  }
  if (stream.bad()) throw unreadable(file);
  return text;
}

TextLines::TextLines(const fs::path& file) : file_(file), stream_(open(file)) {}

std::optional<std::string> TextLines::next() {
  std::string line;
  std::getline(stream_, line);
  if (stream_.bad()) throw unreadable(file_);
  if (!stream_.good()) return std::nullopt;  // at the end; a line without a newline is left out
  ++number_;
  return line;
}

fs::path resolve(const fs::path& path, const fs::path& file) {
  const fs::path joined = file.parent_path() / path;  // an absolute path replaces the folder
  const fs::path folded = joined.lexically_normal();
  std::error_code error;
  return fs::exists(joined, error) && !fs::equivalent(joined, folded, error) ? joined : folded;
}

std::string relative_to(const std::filesystem::path& file, const std::filesystem::path& target) {
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  std::error_code none_there;
  const std::filesystem::path relative = std::filesystem::relative(target, folder, none_there);
  return none_there || relative.empty() ? target.string() : relative.string();
}

}  // namespace twocone::config
