// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/v4l2_camera/device.h"

/// An emulated kernel for tests: video devices in memory that follow a script, and count their open files and mappings.
namespace twocone::test {

inline std::chrono::nanoseconds now() { return std::chrono::steady_clock::now().time_since_epoch(); }

struct ScriptedControl {
  std::string title;  ///< the device's name for it: "Exposure Time, Absolute"
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  std::int64_t minimum = 0;
  std::int64_t maximum = 255;
  std::int64_t value = 0;
  std::uint32_t flags = 0;
  std::map<std::int64_t, std::string> menu{};
  std::int64_t step = 1;  ///< a value is rounded down to a multiple of it
  int refused = 0;        ///< errno of a call that sets it; 0: success
};

/// The behaviour of a device; the test may change it at any time.
struct ScriptedDevice {
  std::string path = "/dev/video0";
  std::string card = "Scripted";
  std::uint32_t can = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;  ///< ..._MPLANE: its images have planes
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_YUYV};
  /// Adjusts a requested size, and limits a requested rate.
  std::function<void(std::uint32_t format, std::uint32_t& width, std::uint32_t& height)> adjust{};
  std::function<double(std::uint32_t format)> fastest_hz{};
  bool reports_rate = true;
  bool sets_rate = true;
  double own_rate_hz = 30;   ///< until another rate is set
  double cable_rate_hz = 0;  ///< rate of its digital timings; 0: it has none
  std::uint32_t row_padding = 0;
  std::uint32_t planes = 1;
  std::uint32_t most_buffers = 32;
  bool queries_controls_the_old_way = false;
  std::vector<ScriptedControl> controls{};
  std::uint32_t input_status = 0;
  bool reports_source_changes = false;
  int source_changes = 0;  ///< events that were not read yet

  int open_error = 0;
  /// errno of the next calls of a request; 0: that call succeeds
  std::map<unsigned long, std::deque<int>> errors{};
  /// true: exposures happen by themselves, at the rate; false: only by expose().
  bool runs = false;
  /// Old kernels keep the buffers, and their file, while any of them is mapped.
  bool keeps_mapped_buffers = false;
  std::uint32_t first_sequence = 0;
  int poll_events = 0;      ///< result of poll(); 0: the real events
  int poll_interrupts = 0;  ///< number of interrupted calls of poll()
};

struct Exposure {
  std::uint32_t sequence = 0;
  std::chrono::nanoseconds captured{0};
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  std::uint8_t value = 0;       ///< value of every byte of the image
  std::uint8_t padding = 0xEE;  ///< value of every byte between its rows
  std::uint32_t bytes = 0;      ///< number of bytes; 0: all
};

class ScriptedKernel final : public v4l2::Kernel {
 public:
  ScriptedKernel();
  ~ScriptedKernel() override;

  ScriptedDevice& add(ScriptedDevice device);
  void add_link(const std::string& link, const std::string& path) { links_[link] = path; }
  /// Fills the next buffer that the device has, with the present time. Returns false if it has none: then the exposure
  /// is lost. The sequence number increases in either case.
  bool expose(ScriptedDevice& device);
  bool expose(ScriptedDevice& device, const Exposure& exposure);
  /// Makes all calls on the device's files fail. It can be opened again when the last of them is closed.
  void unplug(ScriptedDevice& device);
  /// The number of files that are open, or kept open by their mappings.
  [[nodiscard]] std::size_t files_held() const;
  [[nodiscard]] std::size_t mappings() const;  ///< also those that were detached
  [[nodiscard]] std::size_t streaming() const;
  [[nodiscard]] std::uint64_t queued(const ScriptedDevice& device) const;
  /// The format to which the device is set.
  [[nodiscard]] v4l2_pix_format format(const ScriptedDevice& device) const;
  [[nodiscard]] int count(unsigned long request) const;  ///< calls so far

  int open(const char* path) override;
  int close(int file) override;
  int ioctl(int file, unsigned long request, void* argument) override;
  void* mmap(int file, std::size_t length, long offset) override;
  int munmap(void* memory, std::size_t length) override;
  int poll(pollfd& entry, int timeout_ms) override;
  int detach(void* memory, std::size_t length) override;
  std::vector<std::string> entries(const std::string& folder) override;
  std::string target(const std::string& path) override;

 private:
  struct Node;
  struct File;
  struct Mapping;

  Node& node_of(const ScriptedDevice& device);
  bool fill(Node& node, const Exposure& exposure);
  void run(Node& node);
  int control(Node& node, unsigned long request, void* argument);
  int stream(File& file, unsigned long request, void* argument);
  int settings(Node& node, unsigned long request, void* argument);
  int request_buffers(File& file, v4l2_requestbuffers& wanted);
  void end_stream(Node& node);
  void release_unused();

  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::map<int, std::shared_ptr<File>> files_;
  std::map<void*, Mapping> mappings_;
  std::map<std::string, std::string> links_;
  std::map<unsigned long, int> counts_;
  int next_file_ = 100;
};

}  // namespace twocone::test
