// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2_camera/loopback.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "base/unique_fd.h"

namespace twocone::v4l2 {
namespace {

Error failure(const std::string& device, const char* what, int code) {
  const bool is_gone = code == ENODEV || code == ENXIO || code == EIO;
  return {is_gone ? ErrorCode::kDisconnected : ErrorCode::kRefused, "{}: {}: {}{}", device, what, std::strerror(code),
          code == EBUSY ? "; another program writes into it" : ""};
}

class Loopback final : public LoopbackDevice {
 public:
  Loopback(std::string device, base::UniqueFd file) : device_(std::move(device)), file_(std::move(file)) {}

  Status write(const Image& image) override {
    const Result<Image> pixels = to_rgb8(image);
    if (!pixels) return pixels.error();
    if (width_px_ == 0) {
      if (Status set = set_size(*pixels); !set) return set;
    }
    if (pixels->width_px != width_px_ || pixels->height_px != height_px_) {
      return Error(ErrorCode::kBadData, "{}: an image of {} x {}, must be {} x {} as the first", device_,
                   pixels->width_px, pixels->height_px, width_px_, height_px_);
    }
    const std::size_t size = pixels->bytes.size();
    const ssize_t written = ::write(file_.get(), pixels->bytes.data(), size);
    if (written == ssize_t(size)) return {};
    return failure(device_, "an image was not written", written < 0 ? errno : EIO);
  }

 private:
  Status set_size(const Image& image) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = std::uint32_t(image.width_px);
    format.fmt.pix.height = std::uint32_t(image.height_px);
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_RGB24;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.colorspace = V4L2_COLORSPACE_SRGB;
    format.fmt.pix.bytesperline = 3 * format.fmt.pix.width;
    format.fmt.pix.sizeimage = format.fmt.pix.bytesperline * format.fmt.pix.height;
    const v4l2_pix_format wanted = format.fmt.pix;
    if (::ioctl(file_.get(), VIDIOC_S_FMT, &format) != 0) return failure(device_, "its format cannot be set", errno);
    const v4l2_pix_format& set = format.fmt.pix;
    if (set.width != wanted.width || set.height != wanted.height || set.pixelformat != wanted.pixelformat) {
      return Error(ErrorCode::kRefused, "{}: it takes images of {} x {} only", device_, set.width, set.height);
    }
    width_px_ = image.width_px;
    height_px_ = image.height_px;
    return {};
  }

  const std::string device_;
  const base::UniqueFd file_;
  int width_px_ = 0, height_px_ = 0;  ///< 0: not set yet
};

}  // namespace

Result<std::unique_ptr<LoopbackDevice>> open_loopback(const std::string& device) {
  base::UniqueFd file(::open(device.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) {
    const int code = errno;
    if (code == ENOENT) {
      return Error(ErrorCode::kNotFound, "{}: no such device; `modprobe v4l2loopback video_nr=10,11` makes two",
                   device);
    }
    return failure(device, "it cannot be opened", code);
  }
  v4l2_capability capability{};
  const bool is_video = ::ioctl(file.get(), VIDIOC_QUERYCAP, &capability) == 0;
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if (!is_video || (can & V4L2_CAP_VIDEO_OUTPUT) == 0) {
    return Error(ErrorCode::kRefused, "{}: it accepts no images: a device of v4l2loopback is needed", device);
  }
  return std::unique_ptr<LoopbackDevice>(std::make_unique<Loopback>(device, std::move(file)));
}

}  // namespace twocone::v4l2
