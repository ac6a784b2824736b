// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/image_file.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <memory>
#include <string>

#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"

namespace twocone::runlog {
namespace {

constexpr png_uint_32 kMostPixels = 16384;  // of a side

/// What libpng reported. It is no std::string, because a longjmp must not skip a destructor.
using Complaint = std::array<char, 128>;

[[noreturn]] void on_error(png_structp png, png_const_charp what) {
  auto& complaint = *static_cast<Complaint*>(png_get_error_ptr(png));
  std::snprintf(complaint.data(), complaint.size(), "%s", what);
  png_longjmp(png, 1);
}

void on_warning(png_structp /*png*/, png_const_charp /*what*/) {}

/// Calls `work`, which calls libpng. Returns false if libpng reported an error. Then a longjmp has left `work`, so
/// nothing in `work` may have a destructor.
bool completes(png_structp png, const auto& work) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng has no other way out
  work();
  return true;
}

// ---------------------------------------------------------------------------------------------------------- reading

struct Unread {
  std::string_view bytes;
};

void next_bytes(png_structp png, png_bytep to, std::size_t count) {
  auto& unread = *static_cast<Unread*>(png_get_io_ptr(png));
  if (count > unread.bytes.size()) png_error(png, "it is cut off");
  std::copy_n(unread.bytes.begin(), count, to);
  unread.bytes.remove_prefix(count);
}

/// Returns what is wrong with a PNG file, or an empty string. @param rgb receives the image
std::string decode(std::string_view bytes, Image& rgb) {
  Complaint complaint{};
  Unread unread{bytes};
  const auto destroy = [](png_structp png) { png_destroy_read_struct(&png, nullptr, nullptr); };
  const std::unique_ptr<png_struct, decltype(destroy)> owner(
      png_create_read_struct(PNG_LIBPNG_VER_STRING, &complaint, on_error, on_warning));
  png_structp const png = owner.get();
  if (png == nullptr) return "no memory for a PNG decoder";
  const auto destroy_info = [png](png_infop info) { png_destroy_info_struct(png, &info); };
  const std::unique_ptr<png_info, decltype(destroy_info)> info(png_create_info_struct(png), destroy_info);
  if (!info) return "no memory for a PNG decoder";

  png_set_read_fn(png, &unread, next_bytes);
  png_set_user_limits(png, kMostPixels, kMostPixels);
  int passes = 0;
  const bool has_begun = completes(png, [&] {
    png_read_info(png, info.get());
    png_set_expand(png);
    png_set_strip_16(png);
    png_set_strip_alpha(png);
    png_set_gray_to_rgb(png);
    passes = png_set_interlace_handling(png);
    png_read_update_info(png, info.get());
  });
  if (!has_begun) return complaint.data();
  rgb = {int(png_get_image_width(png, info.get())), int(png_get_image_height(png, info.get())), PixelFormat::kRgb8, {}};
  const std::size_t row_bytes = png_get_rowbytes(png, info.get());
  rgb.bytes.resize(row_bytes * std::size_t(rgb.height_px));
  std::uint8_t* const pixels = rgb.bytes.data();
  const bool is_whole = completes(png, [&] {
    for (int pass = 0; pass < passes; ++pass) {
      for (int row = 0; row < rgb.height_px; ++row) png_read_row(png, pixels + row_bytes * std::size_t(row), nullptr);
    }
    png_read_end(png, nullptr);
  });
  return is_whole ? "" : complaint.data();
}

// ---------------------------------------------------------------------------------------------------------- writing

struct Pixels {
  int width_px;
  int height_px;
  int bits;
  int colours;  ///< PNG_COLOR_TYPE_...
  const std::uint8_t* bytes;
};

void keep_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), count);
}

/// @throws DiskError
void write(const std::filesystem::path& file, const Pixels& pixels) {
  Complaint complaint{};
  std::string bytes;
  const auto destroy = [](png_structp png) { png_destroy_write_struct(&png, nullptr); };
  const std::unique_ptr<png_struct, decltype(destroy)> owner(
      png_create_write_struct(PNG_LIBPNG_VER_STRING, &complaint, on_error, on_warning));
  png_structp const png = owner.get();
  if (png == nullptr) throw DiskError("{}: no memory for a PNG encoder", file.string());
  const auto destroy_info = [png](png_infop info) { png_destroy_info_struct(png, &info); };
  const std::unique_ptr<png_info, decltype(destroy_info)> info(png_create_info_struct(png), destroy_info);
  if (!info) throw DiskError("{}: no memory for a PNG encoder", file.string());

  png_set_write_fn(png, &bytes, keep_bytes, nullptr);
  const bool is_whole = completes(png, [&] {
    // zlib's fastest level and one filter (each pixel minus its left neighbour) take half the time of a filter that is
    // chosen row by row.
    png_set_compression_level(png, Z_BEST_SPEED);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_IHDR(png, info.get(), png_uint_32(pixels.width_px), png_uint_32(pixels.height_px), pixels.bits,
                 pixels.colours, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info.get());
    // A PNG file's numbers begin with their upper byte.
    if (pixels.bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    const std::size_t row_bytes = png_get_rowbytes(png, info.get());
    for (int row = 0; row < pixels.height_px; ++row) {
      png_write_row(png, pixels.bytes + row_bytes * std::size_t(row));
    }
    png_write_end(png, nullptr);
  });
  if (!is_whole) throw DiskError("{}: {}", file.string(), complaint.data());
  write_whole(file, bytes);
}

}  // namespace

Result<Image> read_image(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return Error(ErrorCode::kNotFound, "no image {}", file.string());
  std::string bytes;
  try {
    bytes = config::read_text(file);
  } catch (const config::FileError& error) {
    return Error(ErrorCode::kBadData, "{}", error.what());
  }
  Image rgb;
  const std::string wrong = decode(bytes, rgb);
  if (!wrong.empty()) {
    return Error(ErrorCode::kBadData, "{} is not an image that can be read: {}", file.string(), wrong);
  }
  return rgb;
}

Result<cv::Mat> read_rgb(const std::filesystem::path& file) {
  const auto image = read_image(file);
  if (!image) return image.error();
  return estimation::as_mat(*image).clone();
}

void write_image(const std::filesystem::path& file, const Image& image) {
  const bool is_grey = image.format == PixelFormat::kGrey8;
  const auto pixels = is_grey ? Result<Image>(image) : to_rgb8(image);
  if (!pixels) throw base::FormattedError("{}: {}", file.string(), pixels.error().message);
  write(file,
        {image.width_px, image.height_px, 8, is_grey ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, pixels->bytes.data()});
}

void write_grey16(const std::filesystem::path& file, int width_px, int height_px,
                  std::span<const std::uint16_t> pixels) {
  write(file, {width_px, height_px, 16, PNG_COLOR_TYPE_GRAY, reinterpret_cast<const std::uint8_t*>(pixels.data())});
}

}  // namespace twocone::runlog
