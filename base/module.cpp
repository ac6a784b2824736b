// SPDX-License-Identifier: Apache-2.0
#include "base/module.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/errors.h"

namespace twocone::base {
namespace {

namespace fs = std::filesystem;

/// Folders above a file in which lib/twocone may be: PREFIX of PREFIX/lib/python3/dist-packages/twocone/_native.so.
constexpr int kAbove = 5;

void add_above(const fs::path& file, std::vector<fs::path>& folders) {
  fs::path folder = file.parent_path();
  for (int above = 0; above < kAbove && folder.has_relative_path(); ++above, folder = folder.parent_path()) {
    folders.push_back(folder / "lib" / "twocone");
  }
}

std::vector<fs::path> places() {
  std::vector<fs::path> folders;
  if (const char* folder = std::getenv("TWOCONE_MODULES")) folders.emplace_back(folder);
  std::error_code none;
  add_above(fs::read_symlink("/proc/self/exe", none), folders);
  Dl_info here{};
  if (::dladdr(reinterpret_cast<const void*>(&find_module), &here) != 0) {
    add_above(fs::canonical(here.dli_fname, none), folders);
  }
  return folders;
}

}  // namespace

fs::path find_module(const char* file) {
  for (const fs::path& folder : places()) {
    std::error_code none;
    if (fs::exists(folder / file, none)) return folder / file;
  }
  throw FormattedError("{} was not found; is twocone fully installed? TWOCONE_MODULES can name its folder", file);
}

void* load_module(const char* file, const char* entry) {
  const fs::path path = find_module(file);
  void* const module = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) throw FormattedError("{}", ::dlerror());
  void* const function = ::dlsym(module, entry);
  if (function == nullptr) throw FormattedError("{} is not a module of this program", path.string());
  return function;
}

}  // namespace twocone::base
