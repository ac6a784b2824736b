// SPDX-License-Identifier: Apache-2.0
// Finds the module with the driver and forwards calls to it.
#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {
namespace {

namespace fs = std::filesystem;

// The name has the version of the interface, so that two installed versions do not load each other's module.
constexpr const char* kModuleFile = TWOCONE_LIBCAMERA_MODULE;
// In a build tree, programs are two folders below the top.
constexpr int kAbove = 3;

std::vector<fs::path> places() {
  std::vector<fs::path> folders;
  if (const char* folder = std::getenv("TWOCONE_MODULES")) folders.emplace_back(folder);
  std::error_code none;
  const fs::path program = fs::read_symlink("/proc/self/exe", none);
  fs::path folder = program.parent_path();
  for (int above = 0; above < kAbove && !folder.empty(); ++above, folder = folder.parent_path()) {
    folders.push_back(folder / "lib" / "twocone");
  }
  folders.emplace_back(TWOCONE_MODULES_INSTALLED);
  return folders;
}

Result<const Module*> load() {
  for (const fs::path& folder : places()) {
    const fs::path file = folder / kModuleFile;
    std::error_code none;
    if (!fs::exists(file, none)) continue;
    // By default libcamera prints its version and more on stderr. A level that the user has set is kept.
    ::setenv("LIBCAMERA_LOG_LEVELS", kOurLogLevels, 0);
    // The module is never closed: libcamera's threads may outlive any camera.
    void* const module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) return Error(ErrorCode::kUnavailable, "libcamera: {}", ::dlerror());
    const auto entry = reinterpret_cast<const Module* (*)()>(::dlsym(module, kModuleEntry));
    if (entry == nullptr) return Error(ErrorCode::kUnavailable, "{} is not a module of this program", file.string());
    return entry();
  }
  return Error(ErrorCode::kUnavailable,
               "{} was not found; is twocone fully installed? TWOCONE_MODULES can name its folder", kModuleFile);
}

const Result<const Module*>& module() {
  static const Result<const Module*> loaded = load();
  return loaded;
}

}  // namespace

std::string_view why_not() { return ""; }

Result<std::vector<DeviceInfo>> list_cameras() {
  if (!module()) return module().error();
  return (*module())->list_cameras();
}

Result<std::unique_ptr<Camera>> open_camera(const LibcameraSettings& settings) {
  check(settings);
  if (!module()) return module().error();
  return (*module())->open_camera(settings);
}

}  // namespace twocone::libcamera_camera
