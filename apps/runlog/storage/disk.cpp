// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/disk.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

namespace twocone::runlog {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw DiskError("cannot write {}: {}", file.string(), std::strerror(errno));
}

int open_for_writing(const std::filesystem::path& file, int how = O_TRUNC) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0666);
  if (descriptor < 0) fail(file);
  return descriptor;
}

void write_all(int descriptor, std::string_view bytes, const std::filesystem::path& file) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(file);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw DiskError("cannot make the folder {}: {}", folder.string(), error.message());
}

void remove_whole(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::remove_all(path, error);
  if (error) throw DiskError("cannot remove {}: {}", path.string(), error.message());
}

void write_whole(const std::filesystem::path& file, std::string_view content) {
  std::filesystem::path neighbour = file;
  neighbour += ".part";
  int descriptor = open_for_writing(neighbour);
  try {
    write_all(descriptor, content, file);
    if (::close(std::exchange(descriptor, -1)) != 0 || std::rename(neighbour.c_str(), file.c_str()) != 0) fail(file);
  } catch (...) {
    if (descriptor >= 0) ::close(descriptor);
    ::unlink(neighbour.c_str());
    throw;
  }
}

void link_or_copy(const std::filesystem::path& from, const std::filesystem::path& to) {
  make_folder(to.parent_path());
  std::error_code error;
  std::filesystem::create_hard_link(from, to, error);
  if (error) {  // another disk, or one without hard links
    error.clear();
    std::filesystem::copy_file(from, to, error);
  }
  if (error) throw DiskError("cannot write {}: {}", to.string(), error.message());
}

LineFile::LineFile(const std::filesystem::path& file, OldLines old)
    : file_(file), descriptor_(open_for_writing(file, old == OldLines::kDrop ? O_TRUNC : O_APPEND)) {
  if (old == OldLines::kKeep) kept_.emplace(file);
}

bool LineFile::pass_over(std::string_view line, Equal equal) {
  const auto old = kept_->next();
  if (!old) {
    // The remainder is the incomplete line that the program was writing when it ended.
    if (::ftruncate(descriptor_.get(), static_cast<off_t>(kept_bytes_)) != 0) fail(file_);
    kept_.reset();
    return false;
  }
  std::string_view before = *old;
  if (equal == Equal::kButLastField) {
    before = before.substr(0, before.rfind(','));
    line = line.substr(0, line.rfind(','));
  }
  if (equal != Equal::kNot && before != line) {
    throw DiskError("{}:{}: is '{}', but the repeated run gives '{}': the run cannot be resumed", file_.string(),
                    kept_->number(), before, line);
  }
  kept_bytes_ += old->size() + 1;
  return true;
}

void LineFile::add(std::string_view line, Equal equal) {
  if (kept_ && pass_over(line, equal)) return;
  // Each line is a single write. After a kill, all lines are therefore whole, except for the last one on a full disk.
  write_all(descriptor_.get(), std::string(line) + '\n', file_);
}

}  // namespace twocone::runlog
