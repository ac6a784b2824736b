// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/locked_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <regex>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
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
  if (descriptor_.valid()) (void)!::ftruncate(descriptor_.get(), 0);  // because equal runs must have equal files
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

namespace {

// The names in a run folder other than kResultFiles and the cameras' folders, with those that `report` and `compare
// --scene` add.
constexpr std::array kRunFiles{"run.yaml",  "run.log",           "frames.csv",       "drive.csv",
                               "truth.tum", "odometry.tum",      RunLock::kFileName, "report.html",
                               "figures",   "rendered_from.txt", "methods",          "telemetry.jsonl"};

[[noreturn]] void refuse(const fs::path& folder, const std::string& why) {
  throw DiskError("--force does not replace {}: {}", folder.string(), why);
}

/// Returns true for the working folder itself, too.
bool holds_working_folder(const fs::path& folder) {
  std::error_code error;
  const fs::path real = fs::canonical(folder, error);
  if (error) return false;
  const fs::path working = fs::current_path(error);
  return !error && std::mismatch(real.begin(), real.end(), working.begin(), working.end()).first == real.end();
}

/// Returns the cameras of the run that have images.
std::vector<std::string> cameras_of(const fs::path& folder) {
  try {
    return config::camera_names(read_run_yaml(folder).robot);
  } catch (const config::FileError& error) {
    refuse(folder, fmt::format("it is no run of twocone ({})", error.what()));
  }
}

bool is_of_run(std::string_view name) {
  if (name.ends_with(".part")) name.remove_suffix(std::string_view(".part").size());
  return std::ranges::find(kRunFiles, name) != kRunFiles.end() ||
         std::ranges::find(kResultFiles, name) != kResultFiles.end();
}

/// Accepts NNNNNN.png and the files beside it that --truth and a killed program leave.
bool is_of_frame(const std::string& name) {
  static const std::regex kFrameFile(R"([0-9]{6,}\.(png|truth\.csv)(\.part)?)");
  return std::regex_match(name, kFrameFile);
}

void refuse_others_files(const fs::path& folder) {
  const std::vector<std::string> cameras = cameras_of(folder);
  const auto refuse_file = [&folder](const fs::path& file) {
    refuse(folder, fmt::format("{} does not belong to a run; move it away first", file.string()));
  };
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_symlink()) refuse_file(entry.path());
    if (std::ranges::find(cameras, name) == cameras.end()) {
      if (!is_of_run(name)) refuse_file(entry.path());
      continue;
    }
    for (const auto& image : fs::directory_iterator(entry.path())) {
      if (!is_of_frame(image.path().filename().string())) refuse_file(image.path());
    }
  }
}

/// Returns the lock of a replaceable folder, or nothing if there is nothing to lock.
std::optional<RunLock> lock_replaceable(const fs::path& folder) {
  std::error_code error;
  fs::path last = folder;
  if (!last.has_filename()) last = last.parent_path();  // with a final slash, the link itself would not be checked
  if (fs::is_symlink(last, error)) refuse(folder, "it is a link");
  if (!fs::exists(folder, error) || (fs::is_directory(folder, error) && fs::is_empty(folder, error))) return {};
  if (!fs::is_directory(folder, error)) refuse(folder, "it is no folder");
  if (holds_working_folder(folder)) refuse(folder, "this program works in it");
  try {
    refuse_others_files(folder);
    return RunLock(folder);
  } catch (const fs::filesystem_error& failed) {
    refuse(folder, failed.code().message());
  }
}

}  // namespace

void check_replaceable(const fs::path& folder) { (void)lock_replaceable(folder); }

void remove_run(const fs::path& folder) {
  const std::optional<RunLock> lock = lock_replaceable(folder);
  if (!lock) return;
  // run.yaml is removed last. If the program is killed here, the remains are still a run that can be replaced.
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename() != "run.yaml" && entry.path().filename() != RunLock::kFileName) remove_whole(entry);
  }
  remove_whole(folder);
}

}  // namespace twocone::runlog
