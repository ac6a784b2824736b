// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "tests/drivers/scripted_kernel.h"
#include "tests/drivers/scripted_node.h"

namespace twocone::test {
namespace {

void write_text(void* field, std::size_t size, const std::string& text) {
  std::memset(field, 0, size);
  std::memcpy(field, text.data(), std::min(text.size(), size));
}

std::uint32_t bytes_per_pixel(std::uint32_t format) {
  switch (format) {
    case V4L2_PIX_FMT_YUYV:
    case V4L2_PIX_FMT_UYVY:
      return 2;
    case V4L2_PIX_FMT_RGB24:
    case V4L2_PIX_FMT_BGR24:
      return 3;
    default:
      return 1;
  }
}

bool is_compressed(std::uint32_t format) { return format == V4L2_PIX_FMT_MJPEG || format == V4L2_PIX_FMT_JPEG; }

}  // namespace

int ScriptedKernel::settings(Node& node, unsigned long request, void* argument) {
  ScriptedDevice& device = node.device;
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& answer = *static_cast<v4l2_capability*>(argument);
      answer = {};
      write_text(&answer.card, sizeof answer.card, device.card);
      write_text(&answer.bus_info, sizeof answer.bus_info, "scripted:" + device.path);
      answer.device_caps = device.can;
      answer.capabilities = device.can | V4L2_CAP_DEVICE_CAPS | V4L2_CAP_META_CAPTURE;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& answer = *static_cast<v4l2_fmtdesc*>(argument);
      if (answer.type != node.type() || answer.index >= device.formats.size()) return EINVAL;
      answer.pixelformat = device.formats[answer.index];
      return 0;
    }
    case VIDIOC_ENUM_FRAMESIZES: {
      auto& answer = *static_cast<v4l2_frmsizeenum*>(argument);
      if (answer.index > 0) return EINVAL;
      answer.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      answer.discrete = {640, 480};
      return 0;
    }
    case VIDIOC_ENUM_FRAMEINTERVALS: {
      auto& answer = *static_cast<v4l2_frmivalenum*>(argument);
      if (answer.index > 1) return EINVAL;
      answer.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      answer.discrete = {1, answer.index == 0 ? 30U : 15U};
      return 0;
    }
    case VIDIOC_S_FMT: {
      auto& wanted = *static_cast<v4l2_format*>(argument);
      if (wanted.type != node.type()) return EINVAL;
      if (!node.buffers.empty()) return EBUSY;
      auto& format = node.format;
      format = {};
      format.width = node.has_planes() ? wanted.fmt.pix_mp.width : wanted.fmt.pix.width;
      format.height = node.has_planes() ? wanted.fmt.pix_mp.height : wanted.fmt.pix.height;
      format.pixelformat = node.has_planes() ? wanted.fmt.pix_mp.pixelformat : wanted.fmt.pix.pixelformat;
      if (std::find(device.formats.begin(), device.formats.end(), format.pixelformat) == device.formats.end()) {
        format.pixelformat = device.formats.front();
      }
      if (device.adjust) device.adjust(format.pixelformat, format.width, format.height);
      if (!is_compressed(format.pixelformat)) {
        format.bytesperline = format.width * bytes_per_pixel(format.pixelformat) + device.row_padding;
      }
      format.sizeimage =
          is_compressed(format.pixelformat) ? format.width * format.height : format.bytesperline * node.rows();
      if (node.has_planes()) {
        auto& pixels = wanted.fmt.pix_mp;
        pixels.width = format.width;
        pixels.height = format.height;
        pixels.pixelformat = format.pixelformat;
        pixels.num_planes = std::uint8_t(device.planes);
        pixels.plane_fmt[0].bytesperline = format.bytesperline;
        pixels.plane_fmt[0].sizeimage = format.sizeimage;
      } else {
        wanted.fmt.pix = format;
      }
      return 0;
    }
    case VIDIOC_S_PARM: {
      if (!device.sets_rate) return EINVAL;
      auto& wanted = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      node.period = wanted;
      if (device.fastest_hz) {
        const double fastest_hz = device.fastest_hz(node.format.pixelformat);
        if (double(wanted.denominator) / wanted.numerator > fastest_hz) {
          node.period = {1000, std::uint32_t(std::lround(1000 * fastest_hz))};
        }
      }
      return 0;
    }
    case VIDIOC_G_PARM: {
      auto& answer = *static_cast<v4l2_streamparm*>(argument);
      answer.parm.capture = {};
      if (!device.reports_rate) return 0;
      answer.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
      answer.parm.capture.timeperframe =
          device.sets_rate ? node.period : v4l2_fract{1000, std::uint32_t(std::lround(1000 * device.own_rate_hz))};
      return 0;
    }
    case VIDIOC_G_DV_TIMINGS: {
      if (device.cable_rate_hz == 0) return ENODATA;
      auto& answer = *static_cast<v4l2_dv_timings*>(argument);
      answer = {};
      answer.type = V4L2_DV_BT_656_1120;
      answer.bt.width = 640;
      answer.bt.height = 480;
      answer.bt.hfrontporch = 160;
      answer.bt.vfrontporch = 20;
      answer.bt.pixelclock = std::uint64_t(std::llround(device.cable_rate_hz * 800 * 500));
      return 0;
    }
    case VIDIOC_SUBSCRIBE_EVENT:
      return device.reports_source_changes ? 0 : EINVAL;
    case VIDIOC_DQEVENT:
      if (device.source_changes == 0) return ENOENT;
      --device.source_changes;
      return 0;
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_ENUMINPUT:
      static_cast<v4l2_input*>(argument)->status = device.input_status;
      return 0;
    default:
      return ENOTTY;
  }
}

int ScriptedKernel::control(Node& node, unsigned long request, void* argument) {
  auto& controls = node.device.controls;
  constexpr std::uint32_t kFirst = V4L2_CID_BASE;
  const auto at = [&](std::uint32_t id) -> ScriptedControl* {
    return id >= kFirst && id < kFirst + controls.size() ? &controls[id - kFirst] : nullptr;
  };
  const auto after = [&](std::uint32_t id) {
    const std::uint32_t last = id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
    return last < kFirst ? kFirst : last + 1;
  };
  switch (request) {
    case VIDIOC_QUERY_EXT_CTRL: {
      if (node.device.queries_controls_the_old_way) return ENOTTY;
      auto& answer = *static_cast<v4l2_query_ext_ctrl*>(argument);
      const std::uint32_t id = after(answer.id);
      const ScriptedControl* const found = at(id);
      if (found == nullptr) return EINVAL;
      answer = {};
      answer.id = id;
      answer.type = found->type;
      write_text(&answer.name, sizeof answer.name, found->title);
      answer.minimum = found->minimum;
      answer.maximum = found->maximum;
      answer.flags = found->flags;
      return 0;
    }
    case VIDIOC_QUERYCTRL: {
      auto& answer = *static_cast<v4l2_queryctrl*>(argument);
      const std::uint32_t id = after(answer.id);
      const ScriptedControl* const found = at(id);
      if (found == nullptr) return EINVAL;
      const bool is_long = found->type == V4L2_CTRL_TYPE_INTEGER64;
      answer = {};
      answer.id = id;
      answer.type = found->type;
      write_text(&answer.name, sizeof answer.name, found->title);
      answer.minimum = is_long ? 0 : std::int32_t(found->minimum);
      answer.maximum = is_long ? 0 : std::int32_t(found->maximum);
      answer.flags = found->flags;
      return 0;
    }
    case VIDIOC_QUERYMENU: {
      auto& answer = *static_cast<v4l2_querymenu*>(argument);
      const ScriptedControl* const found = at(answer.id);
      if (found == nullptr || found->menu.count(answer.index) == 0) return EINVAL;
      if (found->type == V4L2_CTRL_TYPE_INTEGER_MENU) {
        answer.value = std::stoll(found->menu.at(answer.index));
      } else {
        write_text(&answer.name, sizeof answer.name, found->menu.at(answer.index));
      }
      return 0;
    }
    case VIDIOC_S_EXT_CTRLS:
    case VIDIOC_G_EXT_CTRLS: {
      auto& value = *static_cast<v4l2_ext_controls*>(argument)->controls;
      ScriptedControl* const found = at(value.id);
      if (found == nullptr) return EINVAL;
      const bool is_long = found->type == V4L2_CTRL_TYPE_INTEGER64;
      if (request == VIDIOC_S_EXT_CTRLS) {
        if (found->refused != 0) return found->refused;
        found->value = is_long ? std::int64_t(value.value64) : std::int64_t(value.value);
        found->value -= found->value % found->step;
      } else if (is_long) {
        value.value64 = found->value;
      } else {
        value.value = std::int32_t(found->value);
      }
      return 0;
    }
    default:
      return ENOTTY;
  }
}

}  // namespace twocone::test
