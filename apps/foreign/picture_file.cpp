// SPDX-License-Identifier: Apache-2.0
#include "apps/foreign/picture_file.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "apps/files/file_error.h"
#include "apps/files/text_file.h"
#include "apps/runs/disk.h"
#include "apps/runs/run_folder.h"
#include "hal/image.h"

namespace twocone::foreign {
namespace {

constexpr std::string_view kPngBegin("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kPngEnd("\0\0\0\0IEND\xae\x42\x60\x82", 12);
constexpr std::string_view kJpegBegin("\xff\xd8", 2);

int big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes) value = value * 256 + static_cast<unsigned char>(c);
  return int(value);
}

std::optional<PictureSize> png_size(std::string_view bytes) {
  constexpr std::size_t kWidthAt = 16;  // signature, then length and name of the header's chunk
  if (bytes.size() < kWidthAt + 8) return std::nullopt;
  return PictureSize{big_endian(bytes.substr(kWidthAt, 4)), big_endian(bytes.substr(kWidthAt + 4, 4))};
}

/// From the frame header, which is behind some segments that tell their lengths.
std::optional<PictureSize> jpeg_size(std::string_view bytes) {
  for (std::size_t at = kJpegBegin.size(); at + 9 <= bytes.size();) {
    if (bytes[at] != '\xff') return std::nullopt;
    const int marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker == 0xff) {  // filling
      ++at;
      continue;
    }
    // 0xc0 to 0xcf are frame headers, but for three tables.
    if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc) {
      return PictureSize{big_endian(bytes.substr(at + 7, 2)), big_endian(bytes.substr(at + 5, 2))};
    }
    at += 2 + std::size_t(big_endian(bytes.substr(at + 2, 2)));
  }
  return std::nullopt;
}

/// Nothing for a PNG picture, which is looked at but not wanted.
std::optional<Image> decode(const std::filesystem::path& file, PictureSize wanted) {
  std::string bytes;
  try {
    bytes = files::read_text(file);
  } catch (const files::FileError& error) {
    throw BadPicture(error.what());
  }
  const bool is_png = bytes.starts_with(kPngBegin);
  if (!is_png && !bytes.starts_with(kJpegBegin)) {
    throw BadPicture(fmt::format("{} is no PNG or JPEG picture", file.string()));
  }
  const auto size = is_png ? png_size(bytes) : jpeg_size(bytes);
  if (!size) throw BadPicture(fmt::format("{} is cut off", file.string()));
  if (size->width_px != wanted.width_px || size->height_px != wanted.height_px) {
    throw files::FileError(fmt::format("{} has {} x {} pixels, must have {} x {} as the robot file's camera",
                                       file.string(), size->width_px, size->height_px, wanted.width_px,
                                       wanted.height_px));
  }
  if (is_png) {
    // Looked for first, as libpng complains of it by itself.
    if (!bytes.ends_with(kPngEnd)) throw BadPicture(fmt::format("{} is cut off", file.string()));
    const cv::Mat encoded(1, int(bytes.size()), CV_8UC1, bytes.data());
    if (cv::imdecode(encoded, cv::IMREAD_COLOR).empty()) {
      throw BadPicture(fmt::format("{} is not a picture that can be read", file.string()));
    }
    return std::nullopt;
  }
  Image image{size->width_px, size->height_px, PixelFormat::kMjpeg, {}};
  image.bytes.assign(bytes.begin(), bytes.end());
  auto rgb = to_rgb8(image);
  if (!rgb) throw BadPicture(fmt::format("{}: {}", file.string(), rgb.error().message));
  return std::move(*rgb);
}

}  // namespace

void check_picture(const std::filesystem::path& file, PictureSize wanted) { decode(file, wanted); }

void store_picture(const std::filesystem::path& file, PictureSize wanted, const std::filesystem::path& to) {
  if (const auto rgb = decode(file, wanted)) {
    runs::write_picture(to, *rgb);
  } else {
    runs::link_or_copy(std::filesystem::canonical(file), to);  // of the file itself, not of a link to it
  }
}

}  // namespace twocone::foreign
