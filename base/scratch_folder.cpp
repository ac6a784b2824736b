// SPDX-License-Identifier: Apache-2.0
#include "base/scratch_folder.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>

namespace twocone::base {
namespace {

namespace fs = std::filesystem;

/// POV-Ray processes that end together with the program may still be writing, so the janitor tries again for ten
/// seconds.
constexpr const char* kJanitor =
    "read -r x; n=0; "
    "while rm -rf -- \"$1\" 2>/dev/null; [ -e \"$1\" ] && [ $n -lt 100 ]; do n=$((n + 1)); sleep 0.1; done";

}  // namespace

ScratchFolder::ScratchFolder(const std::vector<fs::path>& roots) {
  errno = ENOENT;
  for (const fs::path& root : roots) {
    std::string name = (root / "twocone-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) continue;
    path_ = name;
    break;
  }
  if (path_.empty()) throw_errno("no folder for images");
  try {
    Pipe pipe = make_pipe();
    Program janitor;
    janitor.path = "/bin/sh";
    janitor.arguments = {"-c", kJanitor, "twocone-janitor", path_.string()};
    janitor.environment = {"PATH=/usr/bin:/bin"};
    janitor.folder = "/";
    janitor.output = false;
    janitor.input = pipe.read.get();
    janitor.outlives = true;
    janitor_.emplace(janitor);
    alive_ = std::move(pipe.write);
  } catch (const std::system_error&) {
    ::rmdir(path_.c_str());
    throw;
  }
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;  // a destructor has no caller to report it to
  fs::remove_all(path_, ignored);
}

std::vector<fs::path> scratch_roots() {
  std::vector<fs::path> roots;
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime != nullptr && runtime[0] == '/') {
    roots.emplace_back(runtime);
  }
  roots.emplace_back("/dev/shm");
  roots.emplace_back("/tmp");
  return roots;
}

}  // namespace twocone::base
