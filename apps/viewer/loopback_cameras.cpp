// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/loopback_cameras.h"

#include <chrono>
#include <utility>

#include <fmt/format.h>

namespace twocone::viewer {
namespace {

/// Images that wait for their pixels; of a renderer that does not keep up, the oldest are left out.
constexpr std::size_t kMostWaiting = 64;
/// How long to wait for an image between looks at the end.
constexpr std::chrono::milliseconds kLook{100};

}  // namespace

Result<std::unique_ptr<LoopbackCameras>> LoopbackCameras::open(const std::vector<Wanted>& wanted,
                                                               std::function<void(const std::string&)> report) {
  std::unique_ptr<LoopbackCameras> cameras(new LoopbackCameras(std::move(report)));
  for (const Wanted& one : wanted) {
    auto device = v4l2::open_loopback(one.device);
    if (!device) return device.error();
    cameras->outputs_.push_back(std::make_unique<Output>(Output{one.camera, *std::move(device)}));
  }
  for (const auto& output : cameras->outputs_) {
    output->thread = std::thread([&cameras = *cameras, &output = *output] { cameras.write(output); });
  }
  return cameras;
}

LoopbackCameras::~LoopbackCameras() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  for (const auto& output : outputs_) {
    if (output->thread.joinable()) output->thread.join();
  }
}

void LoopbackCameras::ordered(const std::string& robot, const std::string& camera,
                              const std::shared_future<ImageResult>& image) {
  const std::lock_guard lock(mutex_);
  for (const auto& output : outputs_) {
    const std::string full_name = fmt::format("{}.{}", robot, camera);
    if (output->camera == camera) output->camera = full_name;  // the first robot that has such a camera
    if (output->camera != full_name) continue;
    output->waiting.push_back(image);
    if (output->waiting.size() > kMostWaiting) output->waiting.pop_front();
  }
  changed_.notify_all();
}

void LoopbackCameras::write(Output& output) {
  std::string reported;
  while (true) {
    std::shared_future<ImageResult> image;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return is_ending_ || !output.waiting.empty(); });
      if (is_ending_) return;
      image = output.waiting.front();
      output.waiting.pop_front();
    }
    while (image.wait_for(kLook) != std::future_status::ready) {
      const std::lock_guard lock(mutex_);
      if (is_ending_) return;
    }
    const ImageResult& rendered = image.get();
    if (!rendered) continue;  // the robot that has ordered it reports why
    const Status written = output.device->write(**rendered);
    if (written || written.error().message == reported) continue;
    reported = written.error().message;
    const std::lock_guard lock(mutex_);
    report_(reported);
  }
}

}  // namespace twocone::viewer
