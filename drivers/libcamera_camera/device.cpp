// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/device.h"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
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
      return Error(ErrorCode::kUnavailable, "libcamera does not start: {}", std::strerror(-error));
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
    return Error(ErrorCode::kNotFound, "libcamera knows no camera '{}'; there are: {}", name,
                 names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
  }
  if (found.size() > 1) {
    return Error(ErrorCode::kRefused, "{} cameras are called '{}'; name one by its id: {}", found.size(), name,
                 fmt::join(names, ", "));
  }
  if (const int error = found.front()->acquire()) {
    return Error(error == -EBUSY ? ErrorCode::kRefused : ErrorCode::kDisconnected, "{}: {}", name,
                 error == -EBUSY ? "the camera is in use; end the other program that uses it" : std::strerror(-error));
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
  const auto configuration = camera_->generateConfiguration(kViewfinder);
  return configuration && !configuration->empty() && configuration->validate() != lc::CameraConfiguration::Invalid;
}

std::vector<std::string> formats_of(lc::Camera& camera) {
  std::vector<std::string> names;
  const auto configuration = camera.generateConfiguration(kViewfinder);
  if (!configuration || configuration->empty()) return names;
  const auto& offered = configuration->at(0).formats();
  for (const lc::PixelFormat& code : offered.pixelformats()) {
    const auto known = std::ranges::find(kFormats, code, &Format::code);
    if (known == kFormats.end()) continue;
    const lc::SizeRange sizes = offered.range(code);
    names.push_back(fmt::format("{} up to {}x{}", known->name, sizes.max.width, sizes.max.height));
  }
  return names;
}

Error device_error(const std::string& what, int code) {
  const bool is_gone = code == ENODEV || code == EIO || code == ENXIO;
  const ErrorCode kind = is_gone          ? ErrorCode::kDisconnected
                         : code == ENOMEM ? ErrorCode::kUnavailable
                                          : ErrorCode::kRefused;
  return {kind, fmt::format("{}: {}", what, std::strerror(code))};
}

std::shared_ptr<const Memory> Memory::of(const lc::FrameBuffer& buffer) {
  auto mapped = std::make_shared<Memory>();
  for (const auto& plane : buffer.planes()) {
    const std::size_t length = std::size_t(plane.offset) + plane.length;
    void* memory = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, plane.fd.get(), 0);
    if (memory == MAP_FAILED) return nullptr;
    const std::span file(static_cast<const std::uint8_t*>(memory), length);
    mapped->planes_.push_back({plane.fd, memory, plane.offset, file.subspan(plane.offset)});
  }
  return mapped;
}

Memory::~Memory() {
  for (const Plane& plane : planes_) ::munmap(plane.mapped, plane.offset + plane.bytes.size());
}

std::optional<std::span<const std::uint8_t>> Memory::whole() const {
  if (planes_.empty()) return std::nullopt;
  const auto is_apart = [](const Plane& a, const Plane& b) {
    return a.file.get() != b.file.get() || b.offset != a.offset + a.bytes.size();
  };
  if (std::ranges::adjacent_find(planes_, is_apart) != planes_.end()) return std::nullopt;
  // Every mapping, also the last plane's, begins at the start of the file.
  const auto* const file = static_cast<const std::uint8_t*>(planes_.back().mapped);
  return std::span(file + planes_.front().offset, planes_.back().bytes.data() + planes_.back().bytes.size());
}

void Memory::begin_reading() const { sync(DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ); }
void Memory::end_reading() const { sync(DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ); }

void Memory::sync(std::uint64_t flags) const {
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    if (i > 0 && planes_[i].file.get() == planes_[i - 1].file.get()) continue;
    dma_buf_sync sync{flags};
    // Memory of another kind refuses this call, but needs no synchronisation either.
    ::ioctl(planes_[i].file.get(), DMA_BUF_IOCTL_SYNC, &sync);
  }
}

Result<std::shared_ptr<Stream>> Stream::start(std::shared_ptr<Device> device, lc::Stream* stream,
                                              const lc::ControlList& controls) {
  std::shared_ptr<Stream> fresh(new Stream(std::move(device)));
  if (auto prepared = fresh->prepare(stream); !prepared) return prepared.error();
  if (auto runs = fresh->run(controls); !runs) return runs.error();
  return fresh;
}

Stream::~Stream() { stop(); }

Status Stream::prepare(lc::Stream* stream) {
  const std::string& id = device_->camera()->id();
  allocator_ = std::make_unique<lc::FrameBufferAllocator>(device_->camera());
  if (const int error = allocator_->allocate(stream); error < 0) return device_error(id + ": its buffers", -error);
  for (const auto& buffer : allocator_->buffers(stream)) {
    auto request = device_->camera()->createRequest();
    if (!request) return device_error(id + ": a request", ENOMEM);
    if (const int error = request->addBuffer(stream, buffer.get())) return device_error(id + ": a request", -error);
    auto memory = Memory::of(*buffer);
    if (!memory) return device_error(id + ": its buffers' memory", errno);
    memories_.emplace(buffer.get(), std::move(memory));
    requests_.push_back(std::move(request));
  }
  return {};
}

Status Stream::run(const lc::ControlList& controls) {
  const std::string& id = device_->camera()->id();
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->completed.clear();
    shared_->queued = 0;
    shared_->last = std::chrono::steady_clock::now();
  }
  if (const int error = device_->camera()->start(&controls)) return device_error(id + ": starting it", -error);
  const std::lock_guard lock(shared_->mutex);
  running_ = true;
  for (const auto& request : requests_) {
    if (const int error = device_->camera()->queueRequest(request.get())) {
      return device_error(id + ": queueing a request", -error);
    }
    ++shared_->queued;
  }
  return {};
}

std::optional<Newest> Stream::take_newest(SteadyTime deadline) {
  std::unique_lock lock(shared_->mutex);
  shared_->changed.wait_until(lock, deadline, [this] { return shared_->is_gone || !shared_->completed.empty(); });
  if (shared_->is_gone || shared_->completed.empty()) return std::nullopt;
  Newest newest;
  newest.was_starved = shared_->queued == 0;
  for (; shared_->completed.size() > 1; shared_->completed.pop_front()) {
    queue(shared_->completed.front());
    ++newest.passed_over;
  }
  newest.request = shared_->completed.front();
  shared_->completed.pop_front();
  newest.buffer = newest.request->buffers().begin()->second;
  newest.memory = memories_.at(newest.buffer);
  return newest;
}

void Stream::give_back(lc::Request* request) {
  const std::lock_guard lock(shared_->mutex);
  if (running_) queue(request);
}

std::shared_ptr<const void> Stream::lend(const Newest& newest) {
  return {newest.memory.get(),
          [stream = shared_from_this(), memory = newest.memory, request = newest.request](const void*) {
            memory->end_reading();
            stream->give_back(request);
          }};
}

/// Queues a request. The caller holds the lock: queueRequest() only stores the request for libcamera's thread.
void Stream::queue(lc::Request* request) {
  request->reuse(lc::Request::ReuseBuffers);
  // A request that is not accepted is not counted. If the camera is gone, a signal of libcamera reports it.
  if (device_->camera()->queueRequest(request) == 0) ++shared_->queued;
}

std::size_t Stream::queued() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->queued;
}

bool Stream::is_silent(std::chrono::nanoseconds time) const {
  const std::lock_guard lock(shared_->mutex);
  return std::chrono::steady_clock::now() - shared_->last >= time;
}

void Stream::stop() {
  const std::shared_ptr<Device> device = std::exchange(device_, nullptr);
  bool was_running = false;
  {
    const std::lock_guard lock(shared_->mutex);
    was_running = std::exchange(running_, false);
  }
  // Meanwhile the last requests come back in another thread, so the lock must be free.
  if (was_running) device->camera()->stop();
  const std::lock_guard lock(shared_->mutex);
  shared_->completed.clear();
  shared_->queued = 0;
  requests_.clear();
  memories_.clear();
  allocator_.reset();
}

void Stream::abandon(const std::shared_ptr<Stream>& stream) {
  static std::mutex& mutex = *new std::mutex;
  static auto& abandoned = *new std::vector<std::shared_ptr<Stream>>;
  {
    const std::lock_guard lock(stream->shared_->mutex);
    stream->running_ = false;
  }
  // libcamera reports a missing device a thousand times a second.
  lc::logSetLevel("V4L2", "FATAL");
  const std::lock_guard lock(mutex);
  abandoned.push_back(stream);
}

}  // namespace twocone::libcamera_camera
