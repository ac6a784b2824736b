// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/stream.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace twocone::libcamera_camera {

Error device_error(const std::string& what, int code) {
  const bool is_gone = code == ENODEV || code == EIO || code == ENXIO;
  const ErrorCode told = is_gone          ? ErrorCode::kDisconnected
                         : code == ENOMEM ? ErrorCode::kUnavailable
                                          : ErrorCode::kRefused;
  return {told, fmt::format("{}: {}", what, std::strerror(code))};
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
    const std::lock_guard lock(told_->mutex);
    told_->completed.clear();
    told_->queued = 0;
    told_->last = std::chrono::steady_clock::now();
  }
  if (const int error = device_->camera()->start(&controls)) return device_error(id + ": starting it", -error);
  const std::lock_guard lock(told_->mutex);
  running_ = true;
  for (const auto& request : requests_) {
    if (const int error = device_->camera()->queueRequest(request.get())) {
      return device_error(id + ": queueing a request", -error);
    }
    ++told_->queued;
  }
  return {};
}

std::optional<Newest> Stream::take_newest(SteadyTime deadline) {
  std::unique_lock lock(told_->mutex);
  told_->changed.wait_until(lock, deadline, [this] { return told_->is_gone || !told_->completed.empty(); });
  if (told_->is_gone || told_->completed.empty()) return std::nullopt;
  Newest newest;
  newest.was_starved = told_->queued == 0;
  for (; told_->completed.size() > 1; told_->completed.pop_front()) {
    queue(told_->completed.front());
    ++newest.passed_over;
  }
  newest.request = told_->completed.front();
  told_->completed.pop_front();
  newest.buffer = newest.request->buffers().begin()->second;
  newest.memory = memories_.at(newest.buffer);
  return newest;
}

void Stream::give_back(lc::Request* request) {
  const std::lock_guard lock(told_->mutex);
  if (running_) queue(request);
}

std::shared_ptr<const void> Stream::lend(const Newest& newest) {
  return {newest.memory.get(),
          [stream = shared_from_this(), memory = newest.memory, request = newest.request](const void*) {
            memory->end_reading();
            stream->give_back(request);
          }};
}

/// With the lock. libcamera only notes it here: its own thread hands it on.
void Stream::queue(lc::Request* request) {
  request->reuse(lc::Request::ReuseBuffers);
  // One that is not taken is one fewer: a camera that is gone is told of by itself.
  if (device_->camera()->queueRequest(request) == 0) ++told_->queued;
}

std::size_t Stream::queued() const {
  const std::lock_guard lock(told_->mutex);
  return told_->queued;
}

bool Stream::is_silent(std::chrono::nanoseconds time) const {
  const std::lock_guard lock(told_->mutex);
  return std::chrono::steady_clock::now() - told_->last >= time;
}

void Stream::stop() {
  const std::shared_ptr<Device> device = std::exchange(device_, nullptr);
  bool was_running = false;
  {
    const std::lock_guard lock(told_->mutex);
    was_running = std::exchange(running_, false);
  }
  // Its last requests come back meanwhile, in another thread.
  if (was_running) device->camera()->stop();
  const std::lock_guard lock(told_->mutex);
  told_->completed.clear();
  told_->queued = 0;
  requests_.clear();
  memories_.clear();
  allocator_.reset();
}

void Stream::abandon(const std::shared_ptr<Stream>& stream) {
  static std::mutex& mutex = *new std::mutex;
  static auto& abandoned = *new std::vector<std::shared_ptr<Stream>>;
  {
    const std::lock_guard lock(stream->told_->mutex);
    stream->running_ = false;
  }
  // Of a device that is gone it complains a thousand times a second.
  lc::logSetLevel("V4L2", "FATAL");
  const std::lock_guard lock(mutex);
  abandoned.push_back(stream);
}

}  // namespace twocone::libcamera_camera
