// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/scripted_kernel.h"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <thread>

#include <gtest/gtest.h>

#include "tests/drivers/scripted_node.h"

namespace twocone::test {

using std::chrono::steady_clock;

ScriptedKernel::ScriptedKernel() = default;
ScriptedKernel::~ScriptedKernel() = default;

ScriptedDevice& ScriptedKernel::add(ScriptedDevice device) {
  nodes_.push_back(std::make_unique<Node>());
  nodes_.back()->device = std::move(device);
  return nodes_.back()->device;
}

ScriptedKernel::Node& ScriptedKernel::node_of(const ScriptedDevice& device) {
  return **std::find_if(nodes_.begin(), nodes_.end(), [&](const auto& node) { return &node->device == &device; });
}

bool ScriptedKernel::expose(ScriptedDevice& device) {
  Exposure exposure;
  {
    const std::lock_guard lock(mutex_);
    exposure.sequence = node_of(device).next_sequence;
  }
  exposure.captured = now();
  return expose(device, exposure);
}

bool ScriptedKernel::expose(ScriptedDevice& device, const Exposure& exposure) {
  const std::lock_guard lock(mutex_);
  return fill(node_of(device), exposure);
}

bool ScriptedKernel::fill(Node& node, const Exposure& exposure) {
  node.next_sequence = exposure.sequence + 1;
  if (!node.is_streaming || node.to_fill.empty()) return false;
  const std::uint32_t index = node.to_fill.front();
  node.to_fill.pop_front();
  auto& buffer = node.buffers[index];
  buffer.filled = exposure;
  buffer.used = exposure.bytes != 0 ? exposure.bytes : node.format.sizeimage;
  std::fill(buffer.memory->begin(), buffer.memory->end(), exposure.value);
  if (node.device.row_padding > 0) {
    const std::uint32_t row = node.format.bytesperline - node.device.row_padding;
    for (std::uint32_t y = 0; y < node.rows(); ++y) {
      std::fill_n(buffer.memory->begin() + y * node.format.bytesperline + row, node.device.row_padding,
                  exposure.padding);
    }
  }
  node.filled.push_back(index);
  return true;
}

/// Makes the exposures that are due.
void ScriptedKernel::run(Node& node) {
  if (!node.device.runs || !node.is_streaming) return;
  while (node.next_exposure <= now()) {
    fill(node, {node.next_sequence, node.next_exposure, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, std::uint8_t(node.exposures),
                0xEE, 0});
    node.next_exposure = node.due(++node.exposures + 1);
  }
}

void ScriptedKernel::unplug(ScriptedDevice& device) {
  const std::lock_guard lock(mutex_);
  Node& node = node_of(device);
  for (auto& [number, file] : files_) file->is_dead = file->is_dead || file->node == &node;
  for (auto& [memory, mapping] : mappings_) {
    if (mapping.file && mapping.file->node == &node) mapping.file->is_dead = true;
  }
  node.is_unplugged = true;
  end_stream(node);
  release_unused();
}

std::size_t ScriptedKernel::files_held() const {
  const std::lock_guard lock(mutex_);
  std::vector<const File*> held;
  for (const auto& [number, file] : files_) held.push_back(file.get());
  for (const auto& [memory, mapping] : mappings_) {
    if (mapping.file && !mapping.file->is_open) held.push_back(mapping.file.get());
  }
  std::sort(held.begin(), held.end());
  return std::size_t(std::unique(held.begin(), held.end()) - held.begin());
}

std::size_t ScriptedKernel::mappings() const {
  const std::lock_guard lock(mutex_);
  return mappings_.size();
}

std::size_t ScriptedKernel::streaming() const {
  const std::lock_guard lock(mutex_);
  return std::size_t(std::count_if(nodes_.begin(), nodes_.end(), [](const auto& node) { return node->is_streaming; }));
}

std::uint64_t ScriptedKernel::queued(const ScriptedDevice& device) const {
  const std::lock_guard lock(mutex_);
  const Node& node = const_cast<ScriptedKernel*>(this)->node_of(device);
  return node.to_fill.size();
}

v4l2_pix_format ScriptedKernel::format(const ScriptedDevice& device) const {
  const std::lock_guard lock(mutex_);
  return const_cast<ScriptedKernel*>(this)->node_of(device).format;
}

int ScriptedKernel::count(unsigned long request) const {
  const std::lock_guard lock(mutex_);
  const auto found = counts_.find(request);
  return found == counts_.end() ? 0 : found->second;
}

/// Ends the streams and frees the buffers of files that neither a descriptor nor a mapping holds any more.
void ScriptedKernel::release_unused() {
  const auto is_held = [&](const File* file) {
    return file->is_open || std::any_of(mappings_.begin(), mappings_.end(),
                                        [&](const auto& entry) { return entry.second.file.get() == file; });
  };
  for (auto& node : nodes_) {
    if (node->owner && !is_held(node->owner.get())) {
      end_stream(*node);
      node->buffers.clear();
      node->owner.reset();
    }
    const bool has_dead =
        std::any_of(files_.begin(), files_.end(),
                    [&](const auto& entry) { return entry.second->node == node.get() && entry.second->is_dead; }) ||
        (node->owner && node->owner->is_dead);
    if (node->is_unplugged && !has_dead) node->is_unplugged = false;
  }
}

int ScriptedKernel::open(const char* path) {
  const std::lock_guard lock(mutex_);
  std::string end = path;
  if (const auto link = links_.find(end); link != links_.end()) end = link->second;
  for (auto& node : nodes_) {
    if (node->device.path != end) continue;
    if (node->device.open_error != 0 || node->is_unplugged) {
      errno = node->is_unplugged ? ENODEV : node->device.open_error;
      return -1;
    }
    files_[next_file_] = std::make_shared<File>(File{node.get()});
    return next_file_++;
  }
  errno = ENOENT;
  return -1;
}

int ScriptedKernel::close(int file) {
  const std::lock_guard lock(mutex_);
  const auto found = files_.find(file);
  if (found == files_.end()) {
    ADD_FAILURE() << "closes file " << file << ", which is not open";
    errno = EBADF;
    return -1;
  }
  found->second->is_open = false;
  files_.erase(found);
  release_unused();
  return 0;
}

int ScriptedKernel::ioctl(int file, unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  ++counts_[request];
  const auto found = files_.find(file);
  if (found == files_.end()) {
    ADD_FAILURE() << "makes a call on file " << file << ", which is not open";
    errno = EBADF;
    return -1;
  }
  File& asked = *found->second;
  int error = 0;
  auto& errors = asked.node->device.errors[request];
  if (asked.is_dead) {
    error = ENODEV;
  } else if (!errors.empty()) {
    error = errors.front();
    errors.pop_front();
  }
  if (error == 0) {
    error = settings(*asked.node, request, argument);
    if (error == ENOTTY) error = control(*asked.node, request, argument);
    if (error == ENOTTY) error = stream(asked, request, argument);
  }
  errno = error;
  return error == 0 ? 0 : -1;
}

void ScriptedKernel::end_stream(Node& node) {
  node.is_streaming = false;
  node.to_fill.clear();
  node.filled.clear();
  for (auto& buffer : node.buffers) buffer.is_queued = false;
}

int ScriptedKernel::request_buffers(File& file, v4l2_requestbuffers& wanted) {
  Node& node = *file.node;
  if (wanted.type != node.type() || wanted.memory != V4L2_MEMORY_MMAP) return EINVAL;
  if (node.owner && node.owner.get() != &file) return EBUSY;
  if (node.is_streaming) return EBUSY;
  const bool is_mapped = std::any_of(mappings_.begin(), mappings_.end(),
                                     [&](const auto& entry) { return entry.second.file.get() == &file; });
  if (node.device.keeps_mapped_buffers && is_mapped) return EBUSY;
  wanted.count = std::min(wanted.count, node.device.most_buffers);
  node.buffers.clear();
  node.owner.reset();
  for (auto& [number, open] : files_) {
    if (open.get() == &file && wanted.count > 0) node.owner = open;
  }
  for (std::uint32_t i = 0; i < wanted.count; ++i) {
    node.buffers.push_back({std::make_shared<std::vector<std::uint8_t>>(node.format.sizeimage)});
  }
  return 0;
}

int ScriptedKernel::stream(File& file, unsigned long request, void* argument) {
  Node& node = *file.node;
  auto& asked = *static_cast<v4l2_buffer*>(argument);
  const auto set_length = [&](Node::Buffer& buffer, std::uint32_t used) {
    if (node.has_planes()) {
      asked.m.planes[0].length = std::uint32_t(buffer.memory->size());
      asked.m.planes[0].bytesused = used;
      asked.m.planes[0].m.mem_offset = asked.index * 4096;
    } else {
      asked.length = std::uint32_t(buffer.memory->size());
      asked.bytesused = used;
      asked.m.offset = asked.index * 4096;
    }
  };
  switch (request) {
    case VIDIOC_REQBUFS:
      return request_buffers(file, *static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF:
      if (asked.type != node.type() || asked.index >= node.buffers.size()) return EINVAL;
      set_length(node.buffers[asked.index], 0);
      return 0;
    case VIDIOC_QBUF: {
      if (asked.type != node.type() || asked.index >= node.buffers.size()) return EINVAL;
      auto& buffer = node.buffers[asked.index];
      if (buffer.is_queued) return EINVAL;
      run(node);
      buffer.is_queued = true;
      node.to_fill.push_back(asked.index);
      return 0;
    }
    case VIDIOC_DQBUF: {
      if (asked.type != node.type() || !node.is_streaming) return EINVAL;
      run(node);
      if (node.filled.empty()) return EAGAIN;
      asked.index = node.filled.front();
      node.filled.pop_front();
      auto& buffer = node.buffers[asked.index];
      buffer.is_queued = false;
      set_length(buffer, buffer.used);
      asked.sequence = buffer.filled.sequence;
      asked.flags = buffer.filled.flags;
      const auto whole = std::chrono::floor<std::chrono::seconds>(buffer.filled.captured);
      asked.timestamp.tv_sec = whole.count();
      asked.timestamp.tv_usec =
          std::chrono::duration_cast<std::chrono::microseconds>(buffer.filled.captured - whole).count();
      return 0;
    }
    case VIDIOC_STREAMON:
      if (node.owner.get() != &file) return EINVAL;
      node.is_streaming = true;
      node.next_sequence = node.device.first_sequence;
      node.exposures = 0;
      node.start = now();
      node.next_exposure = node.due(1);
      return 0;
    case VIDIOC_STREAMOFF:
      if (node.owner && node.owner.get() != &file) return EBUSY;
      end_stream(node);
      return 0;
    default:
      return ENOTTY;
  }
}

void* ScriptedKernel::mmap(int file, std::size_t length, long offset) {
  const std::lock_guard lock(mutex_);
  const auto found = files_.find(file);
  const auto index = std::size_t(offset / 4096);
  if (found == files_.end() || index >= found->second->node->buffers.size()) {
    errno = EINVAL;
    return MAP_FAILED;
  }
  const auto& memory = found->second->node->buffers[index].memory;
  if (memory->size() != length) ADD_FAILURE() << "maps " << length << " bytes of " << memory->size();
  mappings_[memory->data()] = {memory, found->second, length};
  return memory->data();
}

int ScriptedKernel::munmap(void* memory, std::size_t length) {
  const std::lock_guard lock(mutex_);
  const auto found = mappings_.find(memory);
  if (found == mappings_.end() || found->second.length != length) {
    ADD_FAILURE() << "unmaps " << length << " bytes that are not mapped";
    errno = EINVAL;
    return -1;
  }
  mappings_.erase(found);
  release_unused();
  return 0;
}

int ScriptedKernel::detach(void* memory, std::size_t length) {
  const std::lock_guard lock(mutex_);
  const auto found = mappings_.find(memory);
  if (found == mappings_.end() || found->second.length != length) {
    ADD_FAILURE() << "detaches " << length << " bytes that are not mapped";
    errno = EINVAL;
    return -1;
  }
  found->second.file.reset();
  release_unused();
  return 0;
}

int ScriptedKernel::poll(pollfd& entry, int timeout_ms) {
  const auto deadline = steady_clock::now() + std::chrono::milliseconds(timeout_ms);
  while (true) {
    nanoseconds next = deadline.time_since_epoch();
    {
      const std::lock_guard lock(mutex_);
      const auto found = files_.find(entry.fd);
      if (found == files_.end()) {
        entry.revents = POLLNVAL;
        return 1;
      }
      Node& node = *found->second->node;
      if (node.device.poll_interrupts > 0) {
        --node.device.poll_interrupts;
        errno = EINTR;
        return -1;
      }
      run(node);
      entry.revents = short(node.filled.empty() ? 0 : POLLIN);
      if (node.device.poll_events != 0) entry.revents = short(node.device.poll_events);
      if (found->second->is_dead) entry.revents = POLLERR | POLLHUP | POLLPRI;
      if (entry.revents != 0) return 1;
      // Another thread may call expose() meanwhile.
      next = std::min(next, now() + nanoseconds(std::chrono::milliseconds(2)));
    }
    if (steady_clock::now() >= deadline) return 0;
    std::this_thread::sleep_until(steady_clock::time_point(next));
  }
}

std::vector<std::string> ScriptedKernel::entries(const std::string& folder) {
  std::vector<std::string> paths;
  const auto add_if_inside = [&](const std::string& path) {
    if (path.substr(0, path.rfind('/')) == folder) paths.push_back(path);
  };
  for (const auto& node : nodes_) add_if_inside(node->device.path);
  for (const auto& [link, path] : links_) add_if_inside(link);
  return paths;
}

std::string ScriptedKernel::target(const std::string& path) {
  const auto link = links_.find(path);
  return link == links_.end() ? path : link->second;
}

}  // namespace twocone::test
