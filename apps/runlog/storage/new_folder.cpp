// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/new_folder.h"

#include <system_error>
#include <utility>

#include "apps/config/yaml/text_file.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;

bool holds_run(const fs::path& folder) {
  if (!fs::exists(folder / "frames.csv")) return fs::exists(folder / "run.yaml");
  config::TextLines lines(folder / "frames.csv");
  (void)lines.next();  // the header
  return lines.next().has_value();
}

}  // namespace

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
