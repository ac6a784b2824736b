// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>
#include <poll.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/v4l2_camera/v4l2_camera.h"
#include "hal/image.h"

namespace twocone::v4l2 {

/// The system calls of the driver, so that a test can emulate the kernel. They return -1 and set errno as their manual
/// pages describe.
class Kernel {
 public:
  virtual ~Kernel() = default;
  virtual int open(const char* path) = 0;  ///< for reading and writing, non-blocking
  virtual int close(int file) = 0;
  virtual int ioctl(int file, unsigned long request, void* argument) = 0;  ///< repeats a call that a signal interrupts
  virtual void* mmap(int file, std::size_t length, long offset) = 0;
  virtual int munmap(void* memory, std::size_t length) = 0;
  virtual int poll(pollfd& entry, int timeout_ms) = 0;

  /// Replaces a mapping by a private copy: same address and same bytes, but no memory of the device. On failure (-1 and
  /// errno) the mapping is unchanged.
  virtual int detach(void* memory, std::size_t length) = 0;
  /// Returns the full paths of the entries of a folder; none if the folder does not exist.
  virtual std::vector<std::string> entries(const std::string& folder) = 0;
  /// Returns the final target of a link; `path` itself if it is not a link.
  virtual std::string target(const std::string& path) = 0;
};

struct Format {
  std::uint32_t code;
  std::string_view name;
  PixelFormat layout;
};

/// Returns the text in a field of a kernel structure, which need not end with a zero byte.
template <typename Byte, std::size_t Size>
std::string text_of(const Byte (&field)[Size]) {
  const auto* const text = reinterpret_cast<const char*>(field);
  return {text, ::strnlen(text, Size)};
}

/// A control, by the name that `v4l2-ctl --list-ctrls` prints, and its value.
using Control = std::pair<std::string, std::int64_t>;

/// The format, size and rate that the device accepted.
struct Negotiated {
  Format format;
  int width_px = 0;
  int height_px = 0;
  std::size_t row_bytes = 0;      ///< of the first plane; 0 if the format has no rows
  std::optional<double> rate_hz;  ///< if the device reports it
};

/// An open video device that captures.
class Device {
 public:
  /// Errors: kNotFound, kRefused, kUnavailable.
  static Result<std::unique_ptr<Device>> open(const std::string& path, std::shared_ptr<Kernel> kernel);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Makes an ioctl call. Returns errno, or 0 for success.
  int call(unsigned long request, void* argument) const;
  [[nodiscard]] int file() const { return file_; }
  [[nodiscard]] const std::shared_ptr<Kernel>& kernel() const { return kernel_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string card() const;
  [[nodiscard]] std::string bus() const;
  [[nodiscard]] std::uint32_t buffer_type() const { return buffer_type_; }
  /// Returns whether the device fills only the buffers that are queued to it. v4l2loopback fills all buffers in turn,
  /// even those that the program holds.
  [[nodiscard]] bool spares_lent_buffers() const;
  [[nodiscard]] bool has_planes() const { return buffer_type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

  [[nodiscard]] std::vector<std::string> modes() const;
  /// Sets format, size and rate, or the nearest available ones. Errors: kRefused, kDisconnected.
  /// @param format empty: the first format that has the size
  [[nodiscard]] Result<Negotiated> negotiate(const CameraSettings& wanted, const std::string& format) const;
  /// Sets a control by its name and returns the value that the device applied.
  /// Errors: kRefused (naming the existing controls or the allowed values), kDisconnected.
  [[nodiscard]] Result<Control> set(const Control& control) const;
  /// Returns the number of the input in use; 0 also if the device does not report it.
  [[nodiscard]] std::uint32_t input() const;
  /// Describes the fault at the input; empty: the device reports none.
  [[nodiscard]] std::string input_trouble() const;

 private:
  Device(std::shared_ptr<Kernel> kernel, std::string path, int file)
      : kernel_(std::move(kernel)), path_(std::move(path)), file_(file) {}

  [[nodiscard]] Result<Control> set(const v4l2_query_ext_ctrl& found, const Control& control) const;
  [[nodiscard]] Result<std::vector<std::uint32_t>> codes() const;
  [[nodiscard]] Result<Negotiated> set_up(const Format& format, const CameraSettings& wanted) const;
  [[nodiscard]] std::optional<double> set_rate(double wanted_hz) const;

  const std::shared_ptr<Kernel> kernel_;
  const std::string path_;
  const int file_;
  std::uint32_t buffer_type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_capability capability_{};
};

/// Returns the path of the device `name`, which is a path or the card's name.
/// Errors: kNotFound, kRefused (several cards have that name).
Result<std::string> find_device(const std::string& name, const std::shared_ptr<Kernel>& kernel);

/// Returns whether an errno means that the device is gone.
bool is_gone(int code);
/// Converts an errno to an error of the camera.
Error device_error(const std::string& what, int code);

/// A filled buffer, which the device does not use until it is given back.
struct Filled {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes;
  std::uint64_t sequence = 0;            ///< number of the exposure since the stream's first buffer, which has 0
  std::chrono::nanoseconds captured{0};  ///< on the monotonic clock, if `is_monotonic`
  bool is_monotonic = false;
  bool is_damaged = false;
};

/// A running stream: the buffers that program and device share. Lent frames keep it alive and give their buffers back
/// from any thread. After stop() they keep only their memory, which no longer belongs to the device.
class Stream : public std::enable_shared_from_this<Stream> {
 public:
  /// Errors: kRefused, kUnavailable, kDisconnected.
  static Result<std::shared_ptr<Stream>> start(const Device& device);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Takes a filled buffer without a wait; nothing: none is filled. Errors: kDisconnected (the stream is broken).
  Result<std::optional<Filled>> take();
  void give_back(std::uint32_t index);
  /// Keeps a buffer's bytes valid as long as a copy of the result exists; then gives the buffer back.
  std::shared_ptr<const void> lend(std::uint32_t index);
  /// Returns the number of buffers that the device has, either to fill or filled and not yet taken.
  [[nodiscard]] std::size_t queued() const;

  /// Returns true if the device's buffers are freed. Otherwise the device must be opened again before the next start.
  bool stop();

 private:
  Stream(std::shared_ptr<Kernel> kernel, int file, std::uint32_t type)
      : kernel_(std::move(kernel)), file_(file), type_(type) {}

  enum class Place {
    kHere,
    kDevice,
    kLent,
    kRefused,  ///< the device did not accept it; it is offered again
  };
  struct Buffer {
    void* memory = nullptr;  ///< null: no longer mapped
    std::size_t length = 0;
    Place place = Place::kHere;
  };
  struct Request;

  int queue(std::uint32_t index);
  void unmap(Buffer& buffer);
  std::uint64_t count(std::uint32_t sequence);

  const std::shared_ptr<Kernel> kernel_;
  const int file_;
  const std::uint32_t type_;
  mutable std::mutex mutex_;
  bool running_ = false;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> last_sequence_;
  std::uint64_t exposures_ = 0;
};

}  // namespace twocone::v4l2
