// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/device.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone::libcamera_camera {
namespace {

/// The manager has its own count of users. A weak_ptr would be empty before its manager has stopped; a second manager,
/// started then, would end the program.
struct TheManager {
  std::mutex mutex;
  std::unique_ptr<lc::CameraManager> running;
  int users = 0;
};
TheManager& the_manager() {
  static TheManager& manager = *new TheManager;  // never deleted: an abandoned stream uses it until the program ends
  return manager;
}

}  // namespace

Result<std::shared_ptr<lc::CameraManager>> use_manager() {
  TheManager& the = the_manager();
  const std::lock_guard lock(the.mutex);
  if (!the.running) {
    auto fresh = std::make_unique<lc::CameraManager>();
    if (const int error = fresh->start()) {
      return Error{ErrorCode::kUnavailable, fmt::format("libcamera does not start: {}", std::strerror(-error))};
    }
    the.running = std::move(fresh);
  }
  ++the.users;
  return std::shared_ptr<lc::CameraManager>(the.running.get(), [&the](lc::CameraManager* manager) {
    const std::lock_guard last_lock(the.mutex);
    if (--the.users > 0) return;
    manager->stop();
    the.running.reset();
  });
}

Result<std::shared_ptr<Device>> Device::open(const std::string& name) {
  auto manager = use_manager();
  if (!manager) return manager.error();
  std::vector<std::shared_ptr<lc::Camera>> found;
  std::vector<std::string> names;
  for (const auto& camera : (*manager)->cameras()) {
    const std::string model = model_of(*camera);
    if (camera->id() == name || model == name) found.push_back(camera);
    names.push_back(fmt::format("{} ('{}')", model, camera->id()));
  }
  if (found.empty()) {
    return Error{ErrorCode::kNotFound, fmt::format("libcamera knows no camera '{}'; there are: {}", name,
                                                   names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))};
  }
  if (found.size() > 1) {
    return Error{ErrorCode::kRefused, fmt::format("{} cameras are called '{}'; name one by its id: {}", found.size(),
                                                  name, fmt::join(names, ", "))};
  }
  if (const int error = found.front()->acquire()) {
    return Error{error == -EBUSY ? ErrorCode::kRefused : ErrorCode::kDisconnected,
                 fmt::format("{}: {}", name,
                             error == -EBUSY ? "the camera is in use; end the other program that uses it"
                                             : std::strerror(-error))};
  }
  return std::shared_ptr<Device>(new Device(*std::move(manager), std::move(found.front())));
}

Device::Device(std::shared_ptr<lc::CameraManager> manager, std::shared_ptr<lc::Camera> camera)
    : manager_(std::move(manager)), camera_(std::move(camera)) {
  camera_->disconnected.connect(shared_.get(), [shared = shared_] {
    const std::lock_guard lock(shared->mutex);
    shared->is_gone = true;
    shared->changed.notify_all();
  });
  camera_->requestCompleted.connect(shared_.get(), [shared = shared_](lc::Request* request) {
    if (request->status() == lc::Request::RequestCancelled) return;
    const std::lock_guard lock(shared->mutex);
    --shared->queued;
    shared->last = std::chrono::steady_clock::now();
    shared->completed.push_back(request);
    shared->changed.notify_all();
  });
}

Device::~Device() {
  camera_->disconnected.disconnect(shared_.get());
  camera_->requestCompleted.disconnect(shared_.get());
  camera_->release();
  camera_.reset();  // must end before the manager
}

bool Device::is_gone() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->is_gone;
}

bool Device::answers() const {
  if (is_gone()) return false;
  // Every pipeline handler tries its formats on the device, so a valid configuration shows that the camera answers.
  const auto configuration = camera_->generateConfiguration(viewfinder());
  return configuration && !configuration->empty() && configuration->validate() != lc::CameraConfiguration::Invalid;
}

std::vector<std::string> formats_of(lc::Camera& camera) {
  std::vector<std::string> names;
  const auto configuration = camera.generateConfiguration(viewfinder());
  if (!configuration || configuration->empty()) return names;
  const auto& offered = configuration->at(0).formats();
  for (const lc::PixelFormat& code : offered.pixelformats()) {
    const auto known =
        std::find_if(formats().begin(), formats().end(), [&](const Format& f) { return f.code == code; });
    if (known == formats().end()) continue;
    const lc::SizeRange sizes = offered.range(code);
    names.push_back(fmt::format("{} up to {}x{}", known->name, sizes.max.width, sizes.max.height));
  }
  return names;
}

}  // namespace twocone::libcamera_camera
