// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/image_file.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <string>

#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"
#include "base/errors.h"

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

/// The structures of a reader or a writer, and what libpng reported about them.
class Png {
 public:
  enum class Kind { kReader, kWriter };

  explicit Png(Kind kind) : kind_(kind) {
    const auto create = kind == Kind::kReader ? png_create_read_struct : png_create_write_struct;
    png_ = create(PNG_LIBPNG_VER_STRING, &complaint_, on_error, on_warning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~Png() {
    kind_ == Kind::kReader ? png_destroy_read_struct(&png_, &info_, nullptr) : png_destroy_write_struct(&png_, &info_);
  }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;

  [[nodiscard]] png_structp png() const { return png_; }
  [[nodiscard]] png_infop info() const { return info_; }

  /// Calls `work`, which calls libpng. Returns what libpng reported as an error, or an empty string. After an error a
  /// longjmp has left `work`, so nothing in `work` may have a destructor.
  std::string error_of(const auto& work) {
    if (info_ == nullptr) return "no memory for libpng";
    if (setjmp(png_jmpbuf(png_)) != 0) return complaint_.data();  // NOLINT(cert-err52-cpp): libpng has no other way out
    work();
    return "";
  }

 private:
  Kind kind_;
  Complaint complaint_{};
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

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
  Png reader(Png::Kind::kReader);
  png_structp const png = reader.png();
  Unread unread{bytes};
  int passes = 0;
  std::string wrong = reader.error_of([&] {
    png_set_read_fn(png, &unread, next_bytes);
    png_set_user_limits(png, kMostPixels, kMostPixels);
    // Without this call, libpng 1.6.48 accepts a file whose last chunk has a wrong CRC.
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_read_info(png, reader.info());
    png_set_expand(png);
    png_set_strip_16(png);
    png_set_strip_alpha(png);
    png_set_gray_to_rgb(png);
    passes = png_set_interlace_handling(png);
    png_read_update_info(png, reader.info());
  });
  if (!wrong.empty()) return wrong;
  rgb = {int(png_get_image_width(png, reader.info())),
         int(png_get_image_height(png, reader.info())),
         PixelFormat::kRgb8,
         {}};
  const std::size_t row_bytes = png_get_rowbytes(png, reader.info());
  rgb.bytes.resize(row_bytes * std::size_t(rgb.height_px));
  std::uint8_t* const pixels = rgb.bytes.data();
  return reader.error_of([&] {
    for (int pass = 0; pass < passes; ++pass) {
      for (int row = 0; row < rgb.height_px; ++row) png_read_row(png, pixels + row_bytes * std::size_t(row), nullptr);
    }
    png_read_end(png, nullptr);
  });
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
  Png writer(Png::Kind::kWriter);
  png_structp const png = writer.png();
  std::string bytes;
  const std::string wrong = writer.error_of([&] {
    png_set_write_fn(png, &bytes, keep_bytes, nullptr);
    // zlib's fastest level and one filter (each pixel minus its left neighbour) take half the time of a filter that is
    // chosen row by row.
    png_set_compression_level(png, Z_BEST_SPEED);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_IHDR(png, writer.info(), png_uint_32(pixels.width_px), png_uint_32(pixels.height_px), pixels.bits,
                 pixels.colours, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, writer.info());
    // A PNG file's numbers begin with their upper byte.
    if (pixels.bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    const std::size_t row_bytes = png_get_rowbytes(png, writer.info());
    for (int row = 0; row < pixels.height_px; ++row) {
      png_write_row(png, pixels.bytes + row_bytes * std::size_t(row));
    }
    png_write_end(png, nullptr);
  });
  if (!wrong.empty()) throw DiskError("{}: {}", file.string(), wrong);
  write_whole(file, bytes);
}

/// Returns the base64 encoding of RFC 4648, padded.
std::string base64(const Bytes& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (k < there ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= there ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
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
  return read_image(file, bytes);
}

Result<Image> read_image(const std::filesystem::path& file, std::string_view bytes) {
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

Result<cv::Mat> read_rgb(const std::filesystem::path& file, const CameraSettings& camera) {
  auto rgb = read_rgb(file);
  if (rgb && (rgb->cols != camera.width_px || rgb->rows != camera.height_px)) {
    return Error(ErrorCode::kBadData, "{} has {} x {} pixels, the robot file says {} x {}", file.string(), rgb->cols,
                 rgb->rows, camera.width_px, camera.height_px);
  }
  return rgb;
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

std::string jpeg_uri(const Image& image, int quality) {
  const auto jpeg = to_mjpeg(image, quality);
  if (!jpeg) throw base::FormattedError("{}", jpeg.error().message);
  return "data:image/jpeg;base64," + base64(jpeg->bytes);
}

}  // namespace twocone::runlog
