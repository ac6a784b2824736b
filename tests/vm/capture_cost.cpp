// SPDX-License-Identifier: Apache-2.0
// The program whose processor time tests/vm/capture_cost.sh measures. It takes frames of two cameras in the devices'
// own format, with one thread for each camera. The frames are neither copied nor converted.
//   capture_cost DEVICE DEVICE FRAMES
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "drivers/v4l2_camera/v4l2_camera.h"

using namespace twocone;

namespace {

constexpr int kMostTimeouts = 20;

struct Taken {
  unsigned long long frames = 0;
  unsigned long long lost = 0;
  unsigned long long lent = 0;
  int timeouts = 0;
  std::string format;
  std::string error;
};

Taken take(const char* device, unsigned long long frames) {
  Taken taken;
  const auto failed = [&taken](const Error& error) {
    taken.error = error.message;
    return taken;
  };
  auto camera = v4l2::open_camera({device, "YUYV", {}});
  if (!camera) return failed(camera.error());
  const auto applied = (*camera)->configure({640, 480, 25});
  if (!applied) return failed(applied.error());
  if (const auto started = (*camera)->start(); !started) return failed(started.error());
  const CameraFacts facts = (*camera)->facts();
  taken.format = facts.format + " " + std::to_string(facts.settings.width_px) + "x" +
                 std::to_string(facts.settings.height_px) + " at " + std::to_string(facts.settings.rate_hz);
  while (taken.frames < frames) {
    const auto frame = (*camera)->grab(std::chrono::seconds(2));
    if (!frame) {
      // On a busy machine, the virtual machine may be suspended for this time.
      if (frame.error().code != ErrorCode::kTimeout || ++taken.timeouts > kMostTimeouts) return failed(frame.error());
      continue;
    }
    ++taken.frames;
    taken.lost += frame->header().lost_before;
    const auto image = frame->image(std::chrono::milliseconds(0));
    if (image && (*image)->bytes.is_lent()) ++taken.lent;
  }
  return taken;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return std::fputs("capture_cost DEVICE DEVICE FRAMES\n", stderr), 2;
  const auto frames = std::strtoull(argv[3], nullptr, 10);
  std::array<Taken, 2> taken;
  {
    std::jthread first([&] { taken[0] = take(argv[1], frames); });
    std::jthread second([&] { taken[1] = take(argv[2], frames); });
  }
  int status = 0;
  for (const Taken& each : taken) {
    std::printf("frames %llu lost %llu lent %llu timeouts %d, %s %s\n", each.frames, each.lost, each.lent,
                each.timeouts, each.format.c_str(), each.error.c_str());
    if (!each.error.empty()) status = 1;
  }
  return status;
}
