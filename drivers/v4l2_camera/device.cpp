// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2_camera/device.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/log.h"
#include "hal/device_info.h"

namespace twocone::v4l2 {
namespace {

/// The formats that the driver supports, in the order in which it tries them.
constexpr std::array kFormats{
    Format{V4L2_PIX_FMT_YUYV, "YUYV", PixelFormat::kYuyv},  Format{V4L2_PIX_FMT_UYVY, "UYVY", PixelFormat::kUyvy},
    Format{V4L2_PIX_FMT_NV12, "NV12", PixelFormat::kNv12},  Format{V4L2_PIX_FMT_RGB24, "RGB3", PixelFormat::kRgb8},
    Format{V4L2_PIX_FMT_BGR24, "BGR3", PixelFormat::kBgr8}, Format{V4L2_PIX_FMT_MJPEG, "MJPG", PixelFormat::kMjpeg},
    Format{V4L2_PIX_FMT_JPEG, "MJPG", PixelFormat::kMjpeg},  // some cameras use this code
    Format{V4L2_PIX_FMT_GREY, "GREY", PixelFormat::kGrey8},
};

double hertz(const v4l2_fract& period) { return double(period.denominator) / double(period.numerator); }

/// Rates are rounded to 1 / kRateDigits Hz: smaller differences are the device's own rounding.
constexpr double kRateDigits = 1000;
double rounded(double rate_hz) {
  return rate_hz < 1 / kRateDigits ? rate_hz : std::round(rate_hz * kRateDigits) / kRateDigits;
}

std::string code_name(std::uint32_t code) {
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>(code >> (8 * i) & 0x7F);
    name.push_back(c >= ' ' ? c : '?');
  }
  return name;
}

constexpr std::string_view kNode = "/dev/video";

bool is_node(const std::string& path) {
  return path.starts_with(kNode) && path.size() > kNode.size() &&
         path.find_first_not_of("0123456789", kNode.size()) == std::string::npos;
}

/// Returns the link that names the device wherever it is plugged in, or else the link that names its place.
std::string stable_path_of(const std::string& path, Kernel& kernel) {
  for (const char* folder : {"/dev/v4l/by-id", "/dev/v4l/by-path"}) {
    auto links = kernel.entries(folder);
    std::ranges::sort(links);
    for (const std::string& link : links) {
      if (kernel.target(link) == path) return link;
    }
  }
  return "";
}

struct Listed {
  std::string card;
  DeviceInfo info;
};

std::vector<Listed> listed(const std::shared_ptr<Kernel>& kernel) {
  std::vector<std::string> paths;
  for (const std::string& path : kernel->entries("/dev")) {
    if (is_node(path)) paths.push_back(path);
  }
  // The order is by number: video2 before video10.
  std::ranges::sort(paths, {}, [](const std::string& path) { return std::pair(path.size(), path); });
  std::vector<Listed> cameras;
  for (const std::string& path : paths) {
    const auto opened = Device::open(path, kernel);
    if (!opened) continue;
    const Device& device = **opened;
    const std::string stable_path = stable_path_of(path, *kernel);
    cameras.push_back({device.card(),
                       {.name = stable_path.empty() ? path : stable_path,
                        .what = fmt::format("{} ({}, {})", device.card(), path, device.bus()),
                        .details = device.modes()}});
  }
  return cameras;
}

}  // namespace

bool is_gone(int code) { return code == ENODEV || code == ENXIO || code == ESHUTDOWN; }

Error device_error(const std::string& what, int code) {
  const std::string message = fmt::format("{}: {}", what, std::strerror(code));
  if (is_gone(code) || code == EIO) return {ErrorCode::kDisconnected, message};
  if (code == ENOENT) return {ErrorCode::kNotFound, message};
  if (code == ENOMEM) return {ErrorCode::kUnavailable, message};
  std::string advice;
  if (code == EBUSY) advice = "; another program uses the camera: end it (fuser shows which)";
  if (code == EACCES || code == EPERM) {
    advice = "; join the group video: sudo usermod -aG video $USER, then log in again";
  }
  if (code == ENOSPC) advice = "; its USB bus has no room for it: MJPG, a smaller size or another port may help";
  return {ErrorCode::kRefused, message + advice};
}

Result<std::unique_ptr<Device>> Device::open(const std::string& path, std::shared_ptr<Kernel> kernel) {
  const auto not_opened = [&](int code) {
    Error error = device_error(path, code);
    if (error.code == ErrorCode::kDisconnected) error.code = ErrorCode::kNotFound;
    return error;
  };
  const int file = kernel->open(path.c_str());
  if (file < 0) return not_opened(errno);
  std::unique_ptr<Device> device(new Device(std::move(kernel), path, file));
  if (const int code = device->call(VIDIOC_QUERYCAP, &device->capability_)) {
    if (is_gone(code)) return not_opened(code);
    return Error(ErrorCode::kRefused, "{} is no video device; name a camera that twocone devices lists", path);
  }
  const std::uint32_t all = device->capability_.capabilities;
  const std::uint32_t can = (all & V4L2_CAP_DEVICE_CAPS) != 0 ? device->capability_.device_caps : all;
  if ((can & V4L2_CAP_STREAMING) == 0 || (can & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) == 0) {
    return Error(ErrorCode::kRefused,
                 "{} ({}) is no camera that streams; name one that twocone devices lists, and "
                 "begin to write to a loopback device before it is opened",
                 path, device->card());
  }
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) device->buffer_type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
  return device;
}

Device::~Device() { kernel_->close(file_); }

int Device::call(unsigned long request, void* argument) const {
  return kernel_->ioctl(file_, request, argument) == 0 ? 0 : errno;
}

std::string Device::card() const { return printable(text_of(capability_.card)); }
bool Device::spares_lent_buffers() const { return text_of(capability_.driver) != "v4l2 loopback"; }
std::string Device::bus() const { return printable(text_of(capability_.bus_info)); }

Result<std::vector<std::uint32_t>> Device::codes() const {
  std::vector<std::uint32_t> codes;
  v4l2_fmtdesc description{};
  description.type = buffer_type_;
  for (;; ++description.index) {
    const int error = call(VIDIOC_ENUM_FMT, &description);
    if (is_gone(error)) return device_error(path_, error);
    if (error != 0) return codes;
    codes.push_back(description.pixelformat);
  }
}

std::vector<std::string> Device::modes() const {
  std::vector<std::string> modes;
  const auto offered = codes();
  if (!offered) return modes;
  for (const std::uint32_t code : *offered) {
    if (std::ranges::find(kFormats, code, &Format::code) == kFormats.end()) {
      modes.push_back(fmt::format("{} (not known to this driver)", code_name(code)));
      continue;
    }
    v4l2_frmsizeenum size{};
    size.pixel_format = code;
    for (; call(VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
      if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
        modes.push_back(fmt::format("{} {}x{} to {}x{}", code_name(code), size.stepwise.min_width,
                                    size.stepwise.min_height, size.stepwise.max_width, size.stepwise.max_height));
        break;
      }
      std::vector<std::string> rates;
      v4l2_frmivalenum interval{};
      interval.pixel_format = code;
      interval.width = size.discrete.width;
      interval.height = size.discrete.height;
      for (; call(VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
        if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE) {
          rates.push_back(fmt::format("{:g} to {:g}", rounded(hertz(interval.stepwise.max)),
                                      rounded(hertz(interval.stepwise.min))));
          break;
        }
        rates.push_back(fmt::format("{:g}", rounded(hertz(interval.discrete))));
      }
      modes.push_back(fmt::format("{} {}x{}{}", code_name(code), size.discrete.width, size.discrete.height,
                                  rates.empty() ? "" : fmt::format(" at {} Hz", fmt::join(rates, ", "))));
    }
  }
  return modes;
}

Result<Negotiated> Device::set_up(const Format& format, const CameraSettings& wanted) const {
  v4l2_format asked{};
  asked.type = buffer_type_;
  Negotiated result{format, 0, 0, 0, std::nullopt};
  std::uint32_t code = 0;
  // The structures for one plane and for several have the same names for what both have.
  const auto ask = [&](auto& pixels) {
    pixels.width = std::uint32_t(wanted.width_px);
    pixels.height = std::uint32_t(wanted.height_px);
    pixels.pixelformat = format.code;
    pixels.field = V4L2_FIELD_NONE;
    const int error = call(VIDIOC_S_FMT, &asked);
    code = pixels.pixelformat;
    result.width_px = int(pixels.width);
    result.height_px = int(pixels.height);
    return error;
  };
  v4l2_pix_format_mplane& planes = asked.fmt.pix_mp;
  if (has_planes()) planes.num_planes = 1;
  if (const int error = has_planes() ? ask(planes) : ask(asked.fmt.pix)) {
    return device_error(fmt::format("{}: its format", path_), error);
  }
  if (has_planes() && planes.num_planes != 1) {
    return Error(ErrorCode::kRefused, "{}: {} in {} planes; ask for another format:", path_, format.name,
                 planes.num_planes);
  }
  result.row_bytes = has_planes() ? planes.plane_fmt[0].bytesperline : asked.fmt.pix.bytesperline;
  if (code != format.code) {
    return Error(ErrorCode::kRefused,
                 "{} gives {} instead of {}; ask for a format: that it has, as twocone devices lists them", path_,
                 code_name(code), format.name);
  }
  if (format.layout != PixelFormat::kMjpeg && !image_bytes(format.layout, result.width_px, result.height_px)) {
    return Error(ErrorCode::kRefused,
                 "{} gives {} x {} pixels, which {} cannot have; ask for another size or format:", path_,
                 result.width_px, result.height_px, format.name);
  }
  result.rate_hz = set_rate(wanted.rate_hz);
  return result;
}

std::optional<double> Device::set_rate(double wanted_hz) const {
  v4l2_streamparm parameters{};
  parameters.type = buffer_type_;
  // The period is a fraction. In whole milliseconds, 30 Hz would become 33 ms.
  constexpr std::uint32_t kScale = 10'000;
  constexpr double kFastest_hz = 100'000;
  const auto scaled_rate = std::uint32_t(std::max(1L, std::lround(std::min(wanted_hz, kFastest_hz) * kScale)));
  const std::uint32_t common = std::gcd(kScale, scaled_rate);
  parameters.parm.capture.timeperframe = {kScale / common, scaled_rate / common};
  // Some cameras have only one rate, which they report but do not let the program set.
  (void)call(VIDIOC_S_PARM, &parameters);
  if (call(VIDIOC_G_PARM, &parameters) == 0 && (parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
    const v4l2_fract& period = parameters.parm.capture.timeperframe;
    if (period.numerator > 0 && period.denominator > 0) return rounded(hertz(period));
  }
  // A video signal (HDMI, for example) has the rate of its source.
  v4l2_dv_timings timings{};
  if (call(VIDIOC_G_DV_TIMINGS, &timings) == 0 && timings.type == V4L2_DV_BT_656_1120) {
    const v4l2_bt_timings& bt = timings.bt;
    const double pixels = double(V4L2_DV_BT_FRAME_WIDTH(&bt)) * double(V4L2_DV_BT_FRAME_HEIGHT(&bt));
    if (pixels > 0 && bt.pixelclock > 0) return rounded(double(bt.pixelclock) / pixels);
  }
  return std::nullopt;
}

Result<Negotiated> Device::negotiate(const CameraSettings& wanted, const std::string& format) const {
  const auto all = codes();
  if (!all) return all.error();
  const auto& offered = *all;
  std::optional<Format> best;
  int most = -1;
  std::optional<Error> last;
  for (const Format& candidate : kFormats) {
    if (!format.empty() && candidate.name != format) continue;
    if (std::ranges::find(offered, candidate.code) == offered.end()) continue;
    auto got = set_up(candidate, wanted);
    if (!got) {
      last = got.error();
      continue;
    }
    const bool right_size = got->width_px == wanted.width_px && got->height_px == wanted.height_px;
    // A camera that is too slow in one format may be fast enough in the next (MJPG).
    const bool fast_enough = !got->rate_hz || *got->rate_hz > 0.99 * wanted.rate_hz;
    if (right_size && fast_enough) return got;
    const int merit = (right_size ? 2 : 0) + (fast_enough ? 1 : 0);
    if (merit > most) {
      most = merit;
      best = candidate;
    }
  }
  if (best) base::Logger("v4l2").warning(path_ + ": size or rate are not as wanted, but the nearest");
  if (best) return set_up(*best, wanted);  // set again, because another format was tried after it
  if (last) return *last;
  std::vector<std::string> names;
  names.reserve(offered.size());
  for (const std::uint32_t code : offered) names.push_back(code_name(code));
  return Error{ErrorCode::kRefused,
               offered.empty()
                   ? fmt::format("{} ({}) has no format at all; a loopback device has none before a program writes to "
                                 "it: begin that first",
                                 path_, card())
                   : fmt::format("{} ({}) has no format {}; it has: {}", path_, card(),
                                 format.empty() ? "that this driver knows" : format, fmt::join(names, ", "))};
}

std::uint32_t Device::input() const {
  int index = 0;
  return call(VIDIOC_G_INPUT, &index) == 0 ? std::uint32_t(index) : 0;
}

std::string Device::input_trouble() const {
  v4l2_input input{};
  input.index = this->input();
  if (call(VIDIOC_ENUMINPUT, &input) != 0) return "";
  if ((input.status & V4L2_IN_ST_NO_POWER) != 0) return "its input has no power";
  if ((input.status & V4L2_IN_ST_NO_SIGNAL) != 0) return "there is no signal at its input";
  if ((input.status & (V4L2_IN_ST_NO_SYNC | V4L2_IN_ST_NO_H_LOCK)) != 0) return "its input finds no lock on the signal";
  return "";
}

std::vector<DeviceInfo> list_cameras(const std::shared_ptr<Kernel>& kernel) {
  std::vector<DeviceInfo> cameras;
  for (Listed& camera : listed(kernel)) cameras.push_back(std::move(camera.info));
  return cameras;
}

std::string node_of(const std::string& device, const std::shared_ptr<Kernel>& kernel) {
  const auto path = find_device(device, kernel);
  return path ? kernel->target(*path) : device;
}

Result<std::string> find_device(const std::string& name, const std::shared_ptr<Kernel>& kernel) {
  if (name.starts_with('/')) return name;
  std::vector<std::string> found;
  std::vector<std::string> cards;
  for (const Listed& camera : listed(kernel)) {
    if (camera.card == name) found.push_back(camera.info.name);
    cards.push_back(fmt::format("'{}'", camera.card));
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    return Error(ErrorCode::kNotFound, "no camera is called '{}'; there are: {}", name,
                 cards.empty() ? "none" : fmt::format("{}", fmt::join(cards, ", ")));
  }
  return Error(ErrorCode::kRefused, "{} cameras are called '{}'; name one by its path: {}", found.size(), name,
               fmt::join(found, ", "));
}

}  // namespace twocone::v4l2
