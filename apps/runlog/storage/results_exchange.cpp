// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/results_exchange.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

// In a stage, it shows that the stage is complete and must replace the old folder. In methods/NAME/, it shows that this
// is done and that the files at the top must follow.
constexpr const char* kJournal = ".exchange";
constexpr std::string_view kTop = "top\n", kMethodAlone = "method\n";
constexpr std::string_view kNew = ".new", kOld = ".old";

fs::path hidden(const fs::path& place, std::string_view kind) {
  return place.parent_path() / fmt::format(".{}{}", place.filename().string(), kind);
}

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
  throw DiskError("cannot replace {}: {}", path.string(), why);
}

void move_folder(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) fail(to, std::strerror(errno));
}

/// Returns false if the file system or the kernel does not support it.
bool exchange_at_once(const fs::path& a, const fs::path& b) {
  if (::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) fail(b, std::strerror(errno));
  return false;
}

/// Moves a stage with a journal to methods/NAME/. The old folder of that name is hidden or removed.
void put_in_place(const fs::path& stage, const fs::path& place, Exchange how, const std::function<void()>& step) {
  std::error_code none;
  if (fs::exists(place, none)) {
    step();
    if (how == Exchange::kAtomic && exchange_at_once(stage, place)) return;
    remove_whole(hidden(place, kOld));
    move_folder(place, hidden(place, kOld));
  }
  step();
  move_folder(stage, place);
}

/// Completes methods/NAME/ with a journal: replaces the files at the top, then removes the old results.
void finish(const fs::path& folder, const fs::path& place, const std::function<void()>& step) {
  if (config::read_text(place / kJournal) == kTop) {
    for (const char* const name : kResultFiles) {
      step();
      if (fs::exists(place / name)) {
        write_whole(folder / name, config::read_text(place / name));
      } else {
        remove_whole(folder / name);  // belongs to the results of another method
      }
    }
  }
  step();
  remove_whole(hidden(place, kNew));
  remove_whole(hidden(place, kOld));
  step();
  remove_whole(place / kJournal);
}

struct MethodFolders {
  std::set<fs::path> places;  ///< methods/NAME, even if only a hidden folder of NAME exists
  std::vector<fs::path> hidden;
};

MethodFolders folders_in(const fs::path& methods) {
  MethodFolders found;
  std::error_code none;
  for (fs::directory_iterator entry(methods, none), end; !none && entry != end; entry.increment(none)) {
    const std::string name = entry->path().filename().string();
    std::string_view method = name;
    for (const std::string_view kind : {kNew, kOld}) {
      if (name.starts_with(".") && name.ends_with(kind) && name.size() > kind.size() + 1) {
        method = std::string_view(name).substr(1, name.size() - 1 - kind.size());
        found.hidden.push_back(entry->path());
      }
    }
    if (!method.starts_with(".")) found.places.insert(methods / method);
  }
  return found;
}

}  // namespace

ResultsExchange::ResultsExchange(fs::path folder, const std::string& method)
    : folder_(std::move(folder)), place_(folder_ / "methods" / method), stage_(hidden(place_, kNew)) {
  remove_whole(stage_);
  make_folder(stage_);
}

ResultsExchange::~ResultsExchange() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove_all(stage_, ignored);
}

void ResultsExchange::commit(OnTop on_top, Exchange how, const std::function<void()>& before_step) {
  before_step();
  write_whole(stage_ / kJournal, on_top == OnTop::kYes ? kTop : kMethodAlone);
  committed_ = true;
  put_in_place(stage_, place_, how, before_step);
  finish(folder_, place_, before_step);
}

void complete_exchanges(const fs::path& folder, const std::function<void()>& before_step) {
  const MethodFolders found = folders_in(folder / "methods");
  for (const fs::path& place : found.places) {
    const bool in_place = fs::exists(place / kJournal);
    if (!in_place && fs::exists(hidden(place, kNew) / kJournal)) {
      put_in_place(hidden(place, kNew), place, Exchange::kAtomic, before_step);
    }
    if (fs::exists(place / kJournal)) finish(folder, place, before_step);
  }
  for (const fs::path& left : found.hidden) remove_whole(left);  // left by programs that ended before their commit
}

fs::path top_results(const fs::path& folder) {
  for (const fs::path& place : folders_in(folder / "methods").places) {
    for (const fs::path& whole : {place, hidden(place, kNew)}) {
      std::error_code none;
      if (fs::exists(whole / kJournal, none) && config::read_text(whole / kJournal) == kTop) return whole;
    }
  }
  return folder;
}

std::string results_state(const fs::path& folder) {
  std::string state;
  const auto add = [&state](const fs::path& path) {
    struct stat is {};
    if (::stat(path.c_str(), &is) == 0) state += fmt::format("{}:{} ", path.filename().string(), is.st_ino);
  };
  for (const char* const name : kResultFiles) add(folder / name);
  for (const fs::path& place : folders_in(folder / "methods").places) {
    add(place);
    add(place / kJournal);
  }
  return state;
}

}  // namespace twocone::runlog
