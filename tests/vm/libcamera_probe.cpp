// SPDX-License-Identifier: Apache-2.0
// Tests one camera through its driver, for tests/vm/vimc.sh. It prints the applied settings, the numbers of frames, the
// errors, and whether the camera can be stopped.
//   libcamera_probe list
//   libcamera_probe CAMERA WIDTH HEIGHT RATE SECONDS [stop|gone|recover|-] [CONTROL=VALUE...]
// stop: ends at the first error; gone: ends at the first kDisconnected; recover: tries to start the camera again after
// kDisconnected, as a run does; -: none of these.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "drivers/backends.h"

using namespace twocone;

namespace {

using Clock = std::chrono::steady_clock;
constexpr const char* kDriver = "libcamera_camera";

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void print(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

int list() {
  for (const auto& device : drivers::list_devices().found) {
    if (device.driver == kDriver) print(fmt::format("camera {} | {}", device.name, device.what));
  }
  return 0;
}

struct Counted {
  std::uint64_t frames = 0, lost = 0, skipped = 0, wrong_size = 0, backwards = 0, lent = 0;
  std::optional<Timestamp> first, last;
  Clock::time_point at = Clock::now();
  double longest_gap_ms = 0;

  void note(const Frame& frame, const CameraSettings& applied) {
    if (frames > 0) longest_gap_ms = std::max(longest_gap_ms, ms_since(at));
    at = Clock::now();
    ++frames;
    lost += frame.header().lost_before;
    skipped += frame.header().skipped_before;
    const auto image = frame.image(std::chrono::milliseconds(0));
    const bool is_right =
        image && (*image)->width_px == applied.width_px && (*image)->height_px == applied.height_px && to_rgb8(**image);
    if (!is_right) ++wrong_size;
    if (image && (*image)->bytes.is_lent()) ++lent;
    if (last && (frame.header().captured - *last).count() <= 0) ++backwards;
    last = frame.header().captured;
    if (!first) first = last;
  }

  [[nodiscard]] double rate_hz() const {
    if (frames < 2) return 0;
    return double(frames - 1) / std::chrono::duration<double>(*last - *first).count();
  }
};

bool look_again(Camera& camera, const CameraSettings& wanted, Clock::time_point end) {
  const auto begin = Clock::now();
  camera.stop();
  print(fmt::format("stopped after {:.0f} ms", ms_since(begin)));
  while (Clock::now() < end) {
    if (camera.configure(wanted) && camera.start()) {
      print(fmt::format("back after {:.0f} ms", ms_since(begin)));
      return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  return false;
}

/// Checks that a stopped camera starts again without configure(), and that a frame outlives its camera.
int end_well(std::unique_ptr<Camera> camera, bool was_well) {
  std::optional<Frame> kept;
  const auto stop = [&] {
    const auto begin = Clock::now();
    camera->stop();
    print(fmt::format("stopped after {:.0f} ms", ms_since(begin)));
  };
  stop();
  if (was_well) {
    const auto started = camera->start();
    const auto frame = started ? camera->grab(std::chrono::milliseconds(5000)) : Result<Frame>(started.error());
    print("started again: " + (frame ? std::string("a frame") : frame.error().message));
    if (!frame) return 1;
    kept = *frame;
    stop();
  }
  const auto closing = Clock::now();
  camera.reset();
  print(fmt::format("closed after {:.0f} ms", ms_since(closing)));
  if (kept)
    print(to_rgb8(**kept->image(std::chrono::milliseconds(0))) ? "its last frame is still there"
                                                               : "its last frame is bad");
  return 0;
}

int watch(const drivers::CameraPart& part, double seconds, const std::string& on_error) {
  const CameraSettings& wanted = part.settings;
  auto camera = drivers::open_camera("camera", part);
  if (!camera) return print("no camera: " + camera.error().message), 1;
  const auto applied = (*camera)->configure(wanted);
  if (!applied) return print("not configured: " + applied.error().message), 1;
  if (const auto started = (*camera)->start(); !started) return print("not started: " + started.error().message), 1;
  const CameraFacts facts = (*camera)->facts();
  print(fmt::format("applied {}x{} at {:g} Hz ({}), {}, {}", applied->width_px, applied->height_px, applied->rate_hz,
                    facts.has_rate ? "reported" : "as requested", facts.format, facts.device));
  for (const auto& [control, value] : facts.controls) print(fmt::format("control {} {:g}", control, value));
  Counted counted;
  bool was_error = false;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  while (Clock::now() < end) {
    const auto frame = (*camera)->grab(std::chrono::milliseconds(5000));
    if (frame) {
      if (was_error) print("frames again");
      was_error = false;
      counted.note(*frame, *applied);
      continue;
    }
    print(fmt::format("error {} {:.0f} ms after the last frame: {}", to_string(frame.error().code),
                      ms_since(counted.at), frame.error().message));
    was_error = true;
    const bool is_gone = frame.error().code == ErrorCode::kDisconnected;
    if (on_error == "stop" || (on_error == "gone" && is_gone)) break;
    if (on_error == "recover" && is_gone && !look_again(**camera, wanted, end)) {
      print("it did not come back");
      break;
    }
  }
  print(fmt::format("frames {} rate {:.2f} lost {} skipped {} wrong {} backwards {} lent {} gap {:.0f} ms",
                    counted.frames, counted.rate_hz(), counted.lost, counted.skipped, counted.wrong_size,
                    counted.backwards, counted.lent, counted.longest_gap_ms));
  return end_well(*std::move(camera), !was_error);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "list") return list();
  if (argc < 6) {
    std::fputs("libcamera_probe list | CAMERA WIDTH HEIGHT RATE SECONDS [stop|gone|recover|-] [CONTROL=VALUE...]\n",
               stderr);
    return 2;
  }
  drivers::CameraPart part{kDriver, {std::atoi(argv[2]), std::atoi(argv[3]), std::atof(argv[4])}};
  part.device.name = argv[1];
  for (int i = 7; i < argc; ++i) {
    const std::string control = argv[i];
    const auto equals = control.find('=');
    if (equals == std::string::npos) return std::fputs("a control is NAME=VALUE\n", stderr), 2;
    part.device.controls.emplace_back(control.substr(0, equals), std::atof(control.c_str() + equals + 1));
  }
  return watch(part, std::atof(argv[5]), argc > 6 ? argv[6] : "-");
}
