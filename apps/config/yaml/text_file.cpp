// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/text_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include "apps/config/yaml/file_error.h"

namespace twocone::config {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kBlock = 1 << 14;
using Stream = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

FileError unreadable(const fs::path& file) {
  const int why = errno;  // before format() can change it
  return FileError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(why)));
}

Stream open(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) throw FileError(fmt::format("{}: no such file", file.string()));
  if (error) throw FileError(fmt::format("{}: cannot be read: {}", file.string(), error.message()));
  if (fs::is_directory(status)) throw FileError(fmt::format("{}: is a folder, must be a file", file.string()));
  if (!fs::is_regular_file(status)) throw FileError(fmt::format("{}: is not a regular file", file.string()));
  Stream stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!stream) throw unreadable(file);
  return stream;
}

/// Returns whether there was more data.
bool append_block(std::FILE* stream, const fs::path& file, std::string& text) {
  char block[kBlock];
  const std::size_t count = std::fread(block, 1, sizeof block, stream);
  if (count == 0 && std::ferror(stream)) throw unreadable(file);
  text.append(block, count);
  return count > 0;
}

}  // namespace

std::string read_text(const fs::path& file) {
  const Stream stream = open(file);
  std::string text;
  while (append_block(stream.get(), file, text)) {
  }
  return text;
}

TextLines::TextLines(const fs::path& file) : file_(file), stream_(open(file)) {}

std::optional<std::string> TextLines::next() {
  std::size_t end = block_.find('\n', at_);
  while (end == std::string::npos) {
    block_.erase(0, at_);
    at_ = 0;
    const std::size_t looked_through = block_.size();
    if (!append_block(stream_.get(), file_, block_)) return std::nullopt;
    end = block_.find('\n', looked_through);
  }
  std::string line = block_.substr(at_, end - at_);
  at_ = end + 1;
  ++number_;
  return line;
}

fs::path resolve(const fs::path& path, const fs::path& file) {
  const fs::path joined = file.parent_path() / path;  // an absolute path replaces the folder
  const fs::path folded = joined.lexically_normal();
  std::error_code error;
  return fs::exists(joined, error) && !fs::equivalent(joined, folded, error) ? joined : folded;
}

}  // namespace twocone::config
