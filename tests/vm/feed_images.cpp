// SPDX-License-Identifier: Apache-2.0
// Copies images from a port to v4l2loopback devices until the port ends:
//   feed_images PORT FORMAT WIDTH HEIGHT RATE DEVICE...
// PORT delivers the bytes of one image for each device in turn, and gets one byte when the devices are ready. FORMAT is
// YUYV or RGB3. The images of one turn are written together when the last of them has arrived. The first turn is
// reported on standard output, because before it such a device is not a camera. Delayed turns keep the distance of a
// camera's images: the devices stamp images when they get them, and pairs are found by these times.
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace {

int complain(const std::string& what) {
  std::perror(what.c_str());
  return -1;
}

int open_device(const std::string& path, std::uint32_t format, int width_px, int height_px, int rate_hz) {
  const int device = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (device < 0) return complain(path);
  const auto bytes_per_pixel = format == V4L2_PIX_FMT_YUYV ? 2U : 3U;
  v4l2_format wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  wanted.fmt.pix.width = std::uint32_t(width_px);
  wanted.fmt.pix.height = std::uint32_t(height_px);
  wanted.fmt.pix.pixelformat = format;
  wanted.fmt.pix.field = V4L2_FIELD_NONE;
  wanted.fmt.pix.bytesperline = bytes_per_pixel * std::uint32_t(width_px);
  wanted.fmt.pix.sizeimage = wanted.fmt.pix.bytesperline * std::uint32_t(height_px);
  if (::ioctl(device, VIDIOC_S_FMT, &wanted) != 0) return complain(path + ": VIDIOC_S_FMT");
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  rate.parm.output.timeperframe = {1, std::uint32_t(rate_hz)};
  if (::ioctl(device, VIDIOC_S_PARM, &rate) != 0) return complain(path + ": VIDIOC_S_PARM");
  return device;
}

/// Returns false at the end of the port.
bool read_whole(int port, std::vector<std::uint8_t>& room) {
  for (std::size_t filled = 0; filled < room.size();) {
    const ssize_t got = ::read(port, room.data() + filled, room.size() - filled);
    if (got <= 0) return false;
    filled += std::size_t(got);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc < 7 ? "" : argv[2];
  if (name != "YUYV" && name != "RGB3") {
    std::fprintf(stderr, "usage: feed_images PORT YUYV|RGB3 WIDTH HEIGHT RATE DEVICE...\n");
    return 2;
  }
  const std::uint32_t format = name == "YUYV" ? V4L2_PIX_FMT_YUYV : V4L2_PIX_FMT_RGB24;
  const int width_px = std::atoi(argv[3]);
  const int height_px = std::atoi(argv[4]);
  std::vector<int> devices;
  for (int i = 6; i < argc; ++i) {
    devices.push_back(open_device(argv[i], format, width_px, height_px, std::atoi(argv[5])));
    if (devices.back() < 0) return 1;
  }
  const int port = ::open(argv[1], O_RDWR | O_CLOEXEC);
  if (port < 0 || ::write(port, "r", 1) != 1) return complain(argv[1]) != 0;

  const std::size_t bytes = std::size_t(width_px) * std::size_t(height_px) * (format == V4L2_PIX_FMT_YUYV ? 2 : 3);
  std::vector<std::vector<std::uint8_t>> images(devices.size(), std::vector<std::uint8_t>(bytes));
  const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(1 / std::atof(argv[5])));
  auto next = std::chrono::steady_clock::now();
  for (bool is_first = true;; is_first = false) {
    for (auto& image : images) {
      if (!read_whole(port, image)) return 0;
    }
    std::this_thread::sleep_until(next);
    next = std::chrono::steady_clock::now() + period * 3 / 4;
    for (std::size_t i = 0; i < devices.size(); ++i) {
      if (::write(devices[i], images[i].data(), bytes) != ssize_t(bytes)) return complain(argv[6 + i]) != 0;
    }
    if (is_first) std::puts("feeding");
    std::fflush(stdout);
  }
}
