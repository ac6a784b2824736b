// SPDX-License-Identifier: Apache-2.0
// Captures images by the driver of V4L2 cameras, and compares them with those of a run.
//   captured_images capture DEVICE WIDTH HEIGHT RATE_HZ COUNT FILE      until COUNT images, or none for 30 s
//   captured_images compare FILE WIDTH HEIGHT RUN VIEW                  prints how many of the run's images are in the
//   file, in
//                                                                       their order and equal
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/image_file.h"
#include "drivers/v4l2_camera/v4l2_camera.h"
#include "hal/image.h"

using namespace twocone;  // NOLINT(google-build-using-namespace): this is a separate program

namespace {

int fail(const Error& error) { return std::fprintf(stderr, "captured_images: %s\n", error.message.c_str()), 1; }

int capture(const char* device, const CameraSettings& settings, int count, const char* file) {
  constexpr int kMostWaits = 30;  // of a second
  v4l2::V4l2Settings camera_settings;
  camera_settings.name = device;
  camera_settings.format = "RGB3";
  auto camera = v4l2::open_camera(camera_settings);
  if (!camera) return fail(camera.error());
  if (const auto set = (*camera)->configure(settings); !set) return fail(set.error());
  if (const Status started = (*camera)->start(); !started) return fail(started.error());
  std::ofstream to(file, std::ios::binary);
  int taken = 0;
  std::puts("capturing");
  std::fflush(stdout);
  for (int waits = 0; taken < count && waits < kMostWaits;) {
    auto frame = (*camera)->grab(std::chrono::seconds(1));
    if (!frame) {
      ++waits;
      continue;
    }
    const ImageResult image = frame->image(std::chrono::seconds(1));
    if (!image) return fail(image.error());
    const Result<Image> rgb = to_rgb8(**image);
    if (!rgb) return fail(rgb.error());
    to.write(reinterpret_cast<const char*>(rgb->bytes.data()), std::streamsize(rgb->bytes.size()));
    ++taken;
    waits = 0;
  }
  std::printf("captured %d\n", taken);
  return taken == count ? 0 : 1;
}

int compare(const char* file, std::size_t size, const char* run, const std::string& view) {
  std::ifstream from(file, std::ios::binary);
  const std::string captured{std::istreambuf_iterator<char>(from), {}};
  const runlog::RunData data = runlog::read_run(run, "", runlog::Tables::kFrames);
  std::size_t at = 0, equal = 0;
  for (std::size_t i = 0; i < data.frames.size(); ++i) {
    const auto image = runlog::read_image(runlog::images_of(data, i)[view == "lower" ? 0 : 1]);
    if (!image) continue;
    const std::string pixels(image->bytes.begin(), image->bytes.end());
    for (std::size_t look = at; look + size <= captured.size(); look += size) {
      if (captured.compare(look, size, pixels) != 0) continue;
      ++equal;
      at = look + size;
      break;
    }
  }
  std::printf("equal %zu of %zu\n", equal, data.frames.size());
  return equal == data.frames.size() ? 0 : 1;
}

}  // namespace

int main(int argc, char** words) {
  const std::string what = argc > 1 ? words[1] : "";
  if (what == "capture" && argc == 8) {
    return capture(words[2], {std::atoi(words[3]), std::atoi(words[4]), std::atof(words[5])}, std::atoi(words[6]),
                   words[7]);
  }
  if (what == "compare" && argc == 7) {
    return compare(words[2], std::size_t(std::atoi(words[3])) * std::size_t(std::atoi(words[4])) * 3, words[5],
                   words[6]);
  }
  return std::fputs("captured_images capture ... or compare ...: see its source\n", stderr), 2;
}
