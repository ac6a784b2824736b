// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/locked_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/results_exchange.h"
#include "hal/result.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

/// Returns the process number that the holder wrote, or 0 if it cannot be read.
long holder_of(const fs::path& file) {
  long holder = 0;
  std::ifstream(file) >> holder;
  return holder;
}

/// Returns false if another folder has replaced this one since its file was opened.
bool is_still(int descriptor, const fs::path& file) {
  struct stat opened {};
  struct stat there {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(file.c_str(), &there) == 0 && opened.st_ino == there.st_ino &&
         opened.st_dev == there.st_dev;
}

Result<base::UniqueFd> lock(const fs::path& folder) {
  const fs::path file = folder / RunLock::kFileName;
  const auto refused = [](std::string why) { return Error{ErrorCode::kRefused, std::move(why)}; };
  base::UniqueFd descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (!descriptor.valid()) return refused(fmt::format("cannot write {}: {}", file.string(), std::strerror(errno)));
  const bool locked = ::flock(descriptor.get(), LOCK_EX | LOCK_NB) == 0;
  if (!locked && errno != EWOULDBLOCK) {
    return refused(fmt::format("cannot lock {}: {}", file.string(), std::strerror(errno)));
  }
  if (!locked || !is_still(descriptor.get(), file)) {
    const long holder = holder_of(file);
    return refused(
        fmt::format("{} is being written by another program{}: wait until that has ended, or choose another folder",
                    folder.string(), holder > 0 ? fmt::format(" (process {})", holder) : ""));
  }
  const std::string holder = fmt::format("{}\n", ::getpid());
  // The number is only for messages, so a full disk does not prevent the lock.
  if (::ftruncate(descriptor.get(), 0) == 0) (void)!::pwrite(descriptor.get(), holder.data(), holder.size(), 0);
  return descriptor;
}

base::UniqueFd lock_or_throw(const fs::path& folder) {
  auto locked = lock(folder);
  if (!locked) throw DiskError(locked.error().message);
  return *std::move(locked);
}

bool holds_run(const fs::path& folder) {
  if (!fs::exists(folder / "frames.csv")) return fs::exists(folder / "run.yaml");
  config::TextLines lines(folder / "frames.csv");
  (void)lines.next();  // the header
  return lines.next().has_value();
}

}  // namespace

RunLock::RunLock(const fs::path& folder) : RunLock(lock_or_throw(folder)) { complete_exchanges(folder); }

RunLock::~RunLock() {
  if (descriptor_.valid()) (void)!::ftruncate(descriptor_.get(), 0);  // equal runs must have equal files
}

std::optional<RunLock> RunLock::try_take(const fs::path& folder) {
  auto locked = lock(folder);
  if (!locked) return std::nullopt;
  RunLock taken(*std::move(locked));
  complete_exchanges(folder);
  return taken;
}

NewFolder::NewFolder(fs::path folder, OldLines old)
    : folder_(std::move(folder)), was_there_(fs::exists(folder_)), is_kept_(old == OldLines::kKeep) {
  make_folder(folder_);
  lock_.emplace(folder_);
  if (is_kept_) return;
  if (holds_run(folder_)) {
    throw DiskError("{} holds a run already: choose another --out, or replace it with --force", folder_.string());
  }
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (entry.path().filename() != RunLock::kFileName) before_.insert(entry.path());
  }
  try {
    make_folder(folder_ / "lower");
    make_folder(folder_ / "upper");
  } catch (...) {
    clear();
    throw;
  }
}

NewFolder::~NewFolder() {
  if (!is_kept_) clear();
}

void NewFolder::clear() const {
  std::error_code ignored;
  if (!was_there_) {
    fs::remove_all(folder_, ignored);
    return;
  }
  for (fs::directory_iterator entry(folder_, ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    std::error_code error;
    if (!before_.contains(entry->path())) fs::remove_all(entry->path(), error);
  }
}

}  // namespace twocone::runlog
