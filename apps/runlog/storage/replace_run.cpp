// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/locked_folder.h"

#include <algorithm>
#include <array>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "apps/config/yaml/file_error.h"
#include "apps/runlog/run_yaml.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/results_exchange.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

// In addition to kResultFiles and the cameras' folders. Includes the files that `report` and `compare --scene` add.
constexpr std::array kRunFiles{"run.yaml",  "run.log",           "frames.csv",       "drive.csv",
                               "truth.tum", "odometry.tum",      RunLock::kFileName, "report.html",
                               "figures",   "rendered_from.txt", "methods"};

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
  return std::find(kRunFiles.begin(), kRunFiles.end(), name) != kRunFiles.end() ||
         std::find(kResultFiles.begin(), kResultFiles.end(), name) != kResultFiles.end();
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
    if (std::find(cameras.begin(), cameras.end(), name) == cameras.end()) {
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
