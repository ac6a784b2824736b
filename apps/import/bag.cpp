// SPDX-License-Identifier: Apache-2.0
#include "apps/import/bag.h"

#include <sys/wait.h>

#include <chrono>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "apps/config/yaml/text_file.h"
#include "base/child_process.h"
#include "base/errors.h"
#include "base/module.h"

namespace twocone::importer {
namespace {

namespace fs = std::filesystem;

/// Returns the program that reads bags. @throws config::FileError
fs::path reader_of_bags(const fs::path& bag) {
#ifdef TWOCONE_ROSBAG_PROGRAM
  try {
    return base::find_module(TWOCONE_ROSBAG_PROGRAM);
  } catch (const base::FormattedError& error) {
    throw config::FileError("{}: a bag of ROS 1: {} (Debian: twocone-rosbag)", bag.string(), error.what());
  }
#else
  throw config::FileError(
      "{}: a bag of ROS 1, which this build does not read: install librosbag-storage-dev and build again, or make an "
      "MCAP file of it with `mcap convert`",
      bag.string());
#endif
}

/// Returns how long reading a bag may take: longer than any disk needs.
std::chrono::seconds patience(const fs::path& bag) {
  constexpr std::chrono::seconds kLeast{600};
  constexpr std::uintmax_t kBytesPerS = 1'000'000;
  std::error_code unknown;
  const std::uintmax_t size = fs::file_size(bag, unknown);
  return kLeast + std::chrono::seconds(unknown ? 0 : size / kBytesPerS);
}

}  // namespace

void bag_to_mcap(const fs::path& bag, const fs::path& mcap) {
  base::ChildRequest request;
  request.program = {.path = reader_of_bags(bag).string(),
                     .arguments = {fs::absolute(bag).string(), fs::absolute(mcap).string()},
                     .environment = base::own_environment(),
                     .folder = "/",
                     .inputs = {}};
  request.timeout = patience(bag);
  request.max_output = base::kMaxErrors;
  const base::ChildResult result = base::run_child(request);
  using End = base::ChildResult::End;
  if (result.end == End::kEnded && result.wait_status == 0) return;
  std::error_code ignored;
  fs::remove(mcap, ignored);
  if (result.end == End::kTimedOut) throw config::FileError("{}: reading the bag took too long", bag.string());
  if (result.end == End::kNotStarted) throw config::FileError("{}: {}", bag.string(), result.errors);
  // Its last line is ours; the library may have written others before it.
  const std::string text = result.errors.substr(0, result.errors.find_last_not_of('\n') + 1);
  const bool has_ended = result.end == End::kEnded && WIFEXITED(result.wait_status);
  throw config::FileError("{}: {}", bag.string(),
                          has_ended && !text.empty() ? text.substr(text.find_last_of('\n') + 1)
                                                     : "is damaged: the library that reads bags has crashed");
}

}  // namespace twocone::importer
