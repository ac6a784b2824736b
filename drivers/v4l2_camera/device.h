// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/v4l2_camera/kernel.h"
#include "drivers/v4l2_camera/v4l2_camera.h"
#include "hal/image.h"

namespace twocone::v4l2 {

struct Format {
  std::uint32_t code;
  std::string_view name;
  PixelFormat layout;
};
/// Those that the driver knows, in the order in which they are tried.
std::span<const Format> formats();
std::string code_name(std::uint32_t code);

/// What stands in a field of the kernel's, which need not end in a zero.
template <typename Byte, std::size_t Size>
std::string text_of(const Byte (&field)[Size]) {
  const auto* const text = reinterpret_cast<const char*>(field);
  return {text, ::strnlen(text, Size)};
}

/// What the device settled on.
struct Negotiated {
  Format format;
  int width_px = 0;
  int height_px = 0;
  std::size_t row_bytes = 0;      ///< of the first plane; 0 where rows have no meaning
  std::optional<double> rate_hz;  ///< where it tells
};

/// An open video device that captures.
class Device {
 public:
  /// Errors: kNotFound, kRefused, kUnavailable.
  static Result<std::unique_ptr<Device>> open(const std::string& path, std::shared_ptr<Kernel> kernel);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// errno of a call; 0: it worked.
  int call(unsigned long request, void* argument) const;
  [[nodiscard]] int file() const { return file_; }
  [[nodiscard]] Kernel& kernel() const { return *kernel_; }
  [[nodiscard]] const std::shared_ptr<Kernel>& shared_kernel() const { return kernel_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string card() const;
  [[nodiscard]] std::string bus() const;
  [[nodiscard]] std::uint32_t buffer_type() const { return buffer_type_; }
  /// Whether it fills only buffers that it has been handed. v4l2loopback fills them in turn, whoever has them.
  [[nodiscard]] bool spares_lent_buffers() const;
  [[nodiscard]] bool has_planes() const { return buffer_type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

  [[nodiscard]] std::vector<std::string> modes() const;
  /// Sets format, size and rate, or the nearest that there is. @param format empty: the first that has the size
  /// Errors: kRefused, kDisconnected.
  [[nodiscard]] Result<Negotiated> negotiate(const CameraSettings& wanted, const std::string& format) const;
  /// Sets a control by its name and returns what the device made of it.
  /// Errors: kRefused (naming those that there are, or what it may be), kDisconnected.
  [[nodiscard]] Result<Control> set(const Control& control) const;
  /// Which of its inputs is in use; 0: it does not tell.
  [[nodiscard]] std::uint32_t input() const;
  /// What is wrong at the input, in words; empty: nothing that it tells.
  [[nodiscard]] std::string input_trouble() const;

 private:
  Device(std::shared_ptr<Kernel> kernel, std::string path, int file)
      : kernel_(std::move(kernel)), path_(std::move(path)), file_(file) {}

  [[nodiscard]] Result<Control> set(const v4l2_query_ext_ctrl& found, const Control& control) const;
  [[nodiscard]] Result<std::vector<std::uint32_t>> codes() const;
  [[nodiscard]] Result<Negotiated> set_format(const Format& format, const CameraSettings& wanted) const;
  [[nodiscard]] Result<Negotiated> set_up(const Format& format, const CameraSettings& wanted) const;
  [[nodiscard]] std::optional<double> set_rate(double wanted_hz) const;

  const std::shared_ptr<Kernel> kernel_;
  const std::string path_;
  const int file_;
  std::uint32_t buffer_type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_capability capability_{};
};

/// The device that `name` means: a path, or the card's name. Errors: kNotFound, kRefused (several cards of that name).
Result<std::string> find_device(const std::string& name, const std::shared_ptr<Kernel>& kernel);

/// Whether an errno says that the device is not there any more.
bool is_gone(int code);
/// An errno as an error of the camera.
Error device_error(const std::string& what, int code);

}  // namespace twocone::v4l2
