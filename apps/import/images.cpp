// SPDX-License-Identifier: Apache-2.0
#include "apps/import/images.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <boost/algorithm/string.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/tables/tables.h"
#include "hal/image.h"

namespace twocone::importer {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& file) {
  const std::string ending = boost::to_lower_copy(file.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

std::set<fs::path> images_in(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw config::FileError("{} is no folder, must be one with PNG or JPEG images", folder.string());
  }
  std::set<fs::path> names;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_image(entry->path()) && entry->is_regular_file()) names.insert(entry->path().filename());
  }
  if (error) throw config::FileError("{} cannot be read: {}", folder.string(), error.message());
  if (names.empty()) throw config::FileError("{}: no images here, must be files .png, .jpg or .jpeg", folder.string());
  return names;
}

ImageList by_names(const fs::path& folder, StampUnit unit) {
  ImageList list;
  for (const fs::path& name : images_in(folder)) {
    const auto time = parse_stamp(name.stem().string(), unit);
    if (!time) {
      throw config::FileError("{}: the name is '{}', must be the time, {}; or name a file of times",
                              (folder / name).string(), name.stem().string(), stamp_forms(unit));
    }
    list.images.push_back({folder / name, *time});
  }
  auto& images = list.images;
  std::ranges::sort(images, {}, &StampedImage::time);
  const auto twice = std::ranges::adjacent_find(images, {}, &StampedImage::time);
  if (twice != images.end()) {
    throw config::FileError("{} and {} have the same time, must differ", twice->file.string(),
                            (twice + 1)->file.string());
  }
  return list;
}

struct Entry {
  std::string time, name;
};

/// Returns nothing if the line does not have two parts.
std::optional<Entry> entry_of(const std::string& line) {
  constexpr const char* kBlanks = " \t";
  const bool is_csv = line.find(',') != std::string::npos;
  std::vector<std::string> parts;
  if (is_csv) {
    parts = runlog::split_fields(line);
  } else if (const std::size_t blank = line.find_first_of(kBlanks); blank != std::string::npos) {
    parts = {line.substr(0, blank), line.substr(line.find_first_not_of(kBlanks, blank))};
  }
  if (parts.size() != 2) return std::nullopt;
  for (std::string& part : parts) boost::trim_if(part, boost::is_any_of(kBlanks));
  return Entry{parts[0], parts[1]};
}

ImageList by_times_file(const fs::path& folder, const fs::path& times_file, StampUnit unit) {
  const std::set<fs::path> there = images_in(folder);
  const std::vector<Line> lines = read_lines(times_file);
  ImageList list;
  std::map<fs::path, std::size_t> named;  // line number of each name
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    const bool is_cut = i + 1 == lines.size() && !line.whole;
    const auto leave_out = [&](const std::string& why) {
      list.events.push_back(fmt::format("{}:{}: the last line is left out: {}", times_file.string(), line.number, why));
    };
    const auto entry = entry_of(line.text);
    const auto time = entry ? parse_stamp(entry->time, unit) : std::nullopt;
    if (!time) {
      const bool is_header = i == 0 && std::isdigit(static_cast<unsigned char>(line.text[0])) == 0;
      if (is_header) continue;
      if (is_cut) {
        leave_out("it was cut off");
        continue;
      }
      if (!entry) config::refuse_line(times_file, line.number, "'{}' must be TIME NAME or TIME,NAME", line.text);
      config::refuse_line(times_file, line.number, "the time is '{}', must be {}", entry->time, stamp_forms(unit));
    }
    const fs::path name = fs::path(entry->name).filename();
    if (!there.contains(name)) {
      const std::string why = fmt::format("there is no image {}", (folder / name).string());
      if (i + 1 < lines.size()) config::refuse_line(times_file, line.number, "{}", why);
      leave_out(why);
      continue;
    }
    if (!list.images.empty() && *time <= list.images.back().time) {
      config::refuse_line(times_file, line.number, "the time is {}, must be later than that of the image before it",
                          entry->time);
    }
    if (const auto [before, is_new] = named.emplace(name, line.number); !is_new) {
      config::refuse_line(times_file, line.number, "{} stands on line {}, too; must be named once", name.string(),
                          before->second);
    }
    list.images.push_back({folder / name, *time});
  }
  if (list.images.empty()) {
    throw config::FileError("{}: names no image, must have lines TIME NAME or TIME,NAME", times_file.string());
  }
  if (const std::size_t others = there.size() - named.size(); others > 0) {
    list.events.push_back(
        fmt::format("{}: {} images that {} does not name are left out", folder.string(), others, times_file.string()));
  }
  return list;
}

constexpr std::string_view kPngBegin("\x89PNG\r\n\x1a\n", 8);
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
std::optional<Image> decode(const fs::path& file, ImageSize wanted) {
  std::string bytes;
  try {
    bytes = config::read_text(file);
  } catch (const config::FileError& error) {
    throw UnreadableImage(error.what());
  }
  const bool is_png = bytes.starts_with(kPngBegin);
  if (!is_png && !bytes.starts_with(kJpegBegin)) throw UnreadableImage("{} is no PNG or JPEG image", file.string());
  const auto size = is_png ? png_size(bytes) : jpeg_size(bytes);
  if (!size) throw UnreadableImage("{} is cut off", file.string());
  if (size->width_px != wanted.width_px || size->height_px != wanted.height_px) {
    throw config::FileError("{} has {} x {} pixels, must have {} x {} as the robot file's camera", file.string(),
                            size->width_px, size->height_px, wanted.width_px, wanted.height_px);
  }
  if (is_png) {
    if (const auto pixels = runlog::read_image(file, bytes); !pixels)
      throw UnreadableImage("{}", pixels.error().message);
    return std::nullopt;
  }
  Image image{size->width_px, size->height_px, PixelFormat::kMjpeg, {}};
  image.bytes = Bytes(bytes.begin(), bytes.end());
  auto rgb = to_rgb8(image);
  if (!rgb) throw UnreadableImage("{}: {}", file.string(), rgb.error().message);
  return std::move(*rgb);
}

}  // namespace

ImageList list_images(const fs::path& folder, const fs::path& times_file, StampUnit unit) {
  return times_file.empty() ? by_names(folder, unit) : by_times_file(folder, times_file, unit);
}

void check_image(const fs::path& file, ImageSize wanted) { decode(file, wanted); }

void store_image(const fs::path& file, ImageSize wanted, const fs::path& to) {
  if (const auto rgb = decode(file, wanted)) {
    runlog::write_image(to, *rgb);
  } else {
    runlog::link_or_copy(fs::canonical(file), to);  // links the file itself, not a link to it
  }
}

}  // namespace twocone::importer
