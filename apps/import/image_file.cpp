// SPDX-License-Identifier: Apache-2.0
#include "apps/import/image_file.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/storage/disk.h"
#include "hal/image.h"

namespace twocone::importer {
namespace {

constexpr std::string_view kPngBegin("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kPngEnd("\0\0\0\0IEND\xae\x42\x60\x82", 12);
constexpr std::string_view kJpegBegin("\xff\xd8", 2);

int big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes) value = value * 256 + static_cast<unsigned char>(c);
  return int(value);
}

std::optional<ImageSize> png_size(std::string_view bytes) {
  constexpr std::size_t kWidthAt = 16;  // after the signature and the length and name of the header chunk
  if (bytes.size() < kWidthAt + 8) return std::nullopt;
  return ImageSize{big_endian(bytes.substr(kWidthAt, 4)), big_endian(bytes.substr(kWidthAt + 4, 4))};
}

/// Reads the size in the frame header. Segments with a length field precede it.
std::optional<ImageSize> jpeg_size(std::string_view bytes) {
  for (std::size_t at = kJpegBegin.size(); at + 9 <= bytes.size();) {
    if (bytes[at] != '\xff') return std::nullopt;
    const int marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker == 0xff) {  // padding
      ++at;
      continue;
    }
    // 0xc0 to 0xcf are frame headers, except for three tables.
    if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc) {
      return ImageSize{big_endian(bytes.substr(at + 7, 2)), big_endian(bytes.substr(at + 5, 2))};
    }
    at += 2 + std::size_t(big_endian(bytes.substr(at + 2, 2)));
  }
  return std::nullopt;
}

/// Checks an image. Returns the decoded pixels of a JPEG image, and nothing for a PNG image.
std::optional<Image> decode(const std::filesystem::path& file, ImageSize wanted) {
  std::string bytes;
  try {
    bytes = config::read_text(file);
  } catch (const config::FileError& error) {
    throw UnreadableImage(error.what());
  }
  const bool is_png = bytes.starts_with(kPngBegin);
  if (!is_png && !bytes.starts_with(kJpegBegin)) {
    throw UnreadableImage(fmt::format("{} is no PNG or JPEG image", file.string()));
  }
  const auto size = is_png ? png_size(bytes) : jpeg_size(bytes);
  if (!size) throw UnreadableImage(fmt::format("{} is cut off", file.string()));
  if (size->width_px != wanted.width_px || size->height_px != wanted.height_px) {
    throw config::FileError(fmt::format("{} has {} x {} pixels, must have {} x {} as the robot file's camera",
                                        file.string(), size->width_px, size->height_px, wanted.width_px,
                                        wanted.height_px));
  }
  if (is_png) {
    // This is checked first, because libpng prints its own message about it.
    if (!bytes.ends_with(kPngEnd)) throw UnreadableImage(fmt::format("{} is cut off", file.string()));
    const cv::Mat encoded(1, int(bytes.size()), CV_8UC1, bytes.data());
    if (cv::imdecode(encoded, cv::IMREAD_COLOR).empty()) {
      throw UnreadableImage(fmt::format("{} is not an image that can be read", file.string()));
    }
    return std::nullopt;
  }
  Image image{size->width_px, size->height_px, PixelFormat::kMjpeg, {}};
  image.bytes = Bytes(bytes.begin(), bytes.end());
  auto rgb = to_rgb8(image);
  if (!rgb) throw UnreadableImage(fmt::format("{}: {}", file.string(), rgb.error().message));
  return std::move(*rgb);
}

}  // namespace

void check_image(const std::filesystem::path& file, ImageSize wanted) { decode(file, wanted); }

void store_image(const std::filesystem::path& file, ImageSize wanted, const std::filesystem::path& to) {
  if (const auto rgb = decode(file, wanted)) {
    runlog::write_image(to, *rgb);
  } else {
    runlog::link_or_copy(std::filesystem::canonical(file), to);  // links the file itself, not a link to it
  }
}

}  // namespace twocone::importer
