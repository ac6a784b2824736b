// SPDX-License-Identifier: Apache-2.0
// Measures the cost of converting a camera's image to RGB, by to_rgb8 compared with OpenCV: one image of 640 x 480
// pixels, in one thread, each into separate memory. Quote ratios from one run of this program, and medians:
// --benchmark_repetitions=9 --benchmark_report_aggregates_only=true

#include <benchmark/benchmark.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "hal/image.h"

namespace {

using namespace twocone;  // NOLINT(google-build-using-namespace): a program of its own

constexpr int kWidthPx = 640;
constexpr int kHeightPx = 480;

/// Returns an image with slowly changing colours and a little noise, similar to the input of a JPEG decoder.
cv::Mat bgr_image() {
  cv::Mat image(kHeightPx, kWidthPx, CV_8UC3);
  for (int row = 0; row < kHeightPx; ++row) {
    for (int column = 0; column < kWidthPx; ++column) {
      const int noise = (row * 7919 + column * 104729) % 11;
      image.at<cv::Vec3b>(row, column) = {cv::saturate_cast<std::uint8_t>(row / 2 + noise),
                                          cv::saturate_cast<std::uint8_t>(column / 3 + noise),
                                          cv::saturate_cast<std::uint8_t>(255 - (row + column) / 5 - noise)};
    }
  }
  return image;
}

/// Returns the layout's bytes as an OpenCV image; their content does not affect the cost.
cv::Mat raw_image(PixelFormat format) {
  const cv::Mat bgr = bgr_image();
  const int size = int(*image_bytes(format, kWidthPx, kHeightPx));
  const cv::Mat bytes(1, size, CV_8U, bgr.data);
  switch (format) {
    case PixelFormat::kYuyv:
    case PixelFormat::kUyvy:
      return bytes.reshape(2, kHeightPx).clone();
    case PixelFormat::kNv12:
      return bytes.reshape(1, kHeightPx / 2 * 3).clone();
    case PixelFormat::kGrey8:
      return bytes.reshape(1, kHeightPx).clone();
    default:
      return bgr;
  }
}

int conversion(PixelFormat format) {
  switch (format) {
    case PixelFormat::kYuyv:
      return cv::COLOR_YUV2RGB_YUYV;
    case PixelFormat::kUyvy:
      return cv::COLOR_YUV2RGB_UYVY;
    case PixelFormat::kNv12:
      return cv::COLOR_YUV2RGB_NV12;
    case PixelFormat::kGrey8:
      return cv::COLOR_GRAY2RGB;
    default:
      return cv::COLOR_BGR2RGB;
  }
}

void to_rgb8_of(benchmark::State& state, PixelFormat format) {
  const cv::Mat raw = raw_image(format);
  const Image image{kWidthPx, kHeightPx, format, Bytes(raw.datastart, raw.dataend)};
  for (auto _ : state) benchmark::DoNotOptimize(to_rgb8(image));
}

void cvt_color_of(benchmark::State& state, PixelFormat format) {
  const cv::Mat raw = raw_image(format);
  cv::setNumThreads(1);
  for (auto _ : state) {
    cv::Mat rgb;
    cv::cvtColor(raw, rgb, conversion(format));
    benchmark::DoNotOptimize(rgb.data);
  }
}

std::vector<std::uint8_t> jpeg() {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", bgr_image(), bytes, {cv::IMWRITE_JPEG_QUALITY, 85});
  return bytes;
}

void JpegToRgb8(benchmark::State& state) {
  const Image image{kWidthPx, kHeightPx, PixelFormat::kMjpeg, jpeg()};
  for (auto _ : state) benchmark::DoNotOptimize(to_rgb8(image));
}

/// The result stays BGR.
void JpegByImdecode(benchmark::State& state) {
  const auto bytes = jpeg();
  cv::setNumThreads(1);
  for (auto _ : state) benchmark::DoNotOptimize(cv::imdecode(bytes, cv::IMREAD_COLOR));
}

BENCHMARK_CAPTURE(to_rgb8_of, yuyv, PixelFormat::kYuyv)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(cvt_color_of, yuyv, PixelFormat::kYuyv)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(to_rgb8_of, uyvy, PixelFormat::kUyvy)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(cvt_color_of, uyvy, PixelFormat::kUyvy)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(to_rgb8_of, nv12, PixelFormat::kNv12)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(cvt_color_of, nv12, PixelFormat::kNv12)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(to_rgb8_of, bgr, PixelFormat::kBgr8)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(cvt_color_of, bgr, PixelFormat::kBgr8)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(to_rgb8_of, grey, PixelFormat::kGrey8)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(cvt_color_of, grey, PixelFormat::kGrey8)->Unit(benchmark::kMicrosecond);
BENCHMARK(JpegToRgb8)->Unit(benchmark::kMicrosecond);
BENCHMARK(JpegByImdecode)->Unit(benchmark::kMicrosecond);

}  // namespace
