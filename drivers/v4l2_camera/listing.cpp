// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/v4l2_camera/device.h"

namespace twocone::v4l2 {
namespace {

constexpr std::string_view kNode = "/dev/video";

bool is_node(const std::string& path) {
  return path.starts_with(kNode) && path.size() > kNode.size() &&
         path.find_first_not_of("0123456789", kNode.size()) == std::string::npos;
}

/// The link that names the device wherever it is plugged in, or else the link that names its place.
std::string stable_path_of(const std::string& path, Kernel& kernel) {
  for (const char* folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"}) {
    auto links = kernel.entries(folder);
    std::sort(links.begin(), links.end());
    for (const std::string& link : links) {
      if (kernel.target(link) == path) return link;
    }
  }
  return "";
}

}  // namespace

std::vector<CameraInfo> list_cameras(const std::shared_ptr<Kernel>& kernel) {
  std::vector<std::string> paths;
  for (const std::string& path : kernel->entries("/dev")) {
    if (is_node(path)) paths.push_back(path);
  }
  // The order is by number: video2 before video10.
  std::sort(paths.begin(), paths.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  std::vector<CameraInfo> cameras;
  for (const std::string& path : paths) {
    const auto device = Device::open(path, kernel);
    if (!device) continue;
    cameras.push_back({path, stable_path_of(path, *kernel), (*device)->card(), (*device)->bus(), (*device)->modes()});
  }
  return cameras;
}

std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& kernel) {
  const auto path = find_device(device, kernel);
  return path ? kernel->target(*path) : device;
}

Result<std::string> find_device(const std::string& name, const std::shared_ptr<Kernel>& kernel) {
  if (name.starts_with('/')) return name;
  std::vector<std::string> found;
  std::vector<std::string> cards;
  for (const CameraInfo& camera : list_cameras(kernel)) {
    if (camera.card == name) found.push_back(camera.stable_path.empty() ? camera.path : camera.stable_path);
    cards.push_back(fmt::format("'{}'", camera.card));
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    return Error{ErrorCode::kNotFound, fmt::format("no camera is called '{}'; there are: {}", name,
                                                   cards.empty() ? "none" : fmt::format("{}", fmt::join(cards, ", ")))};
  }
  return Error{ErrorCode::kRefused, fmt::format("{} cameras are called '{}'; name one by its path: {}", found.size(),
                                                name, fmt::join(found, ", "))};
}

}  // namespace twocone::v4l2
