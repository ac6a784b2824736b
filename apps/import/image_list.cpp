// SPDX-License-Identifier: Apache-2.0
#include "apps/import/image_list.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <system_error>

#include <fmt/format.h>
#include <boost/algorithm/string.hpp>

#include "apps/config/yaml/file_error.h"
#include "apps/runlog/tables/csv_fields.h"

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
    throw config::FileError(fmt::format("{} is no folder, must be one with PNG or JPEG images", folder.string()));
  }
  std::set<fs::path> names;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_image(entry->path()) && entry->is_regular_file()) names.insert(entry->path().filename());
  }
  if (error) throw config::FileError(fmt::format("{} cannot be read: {}", folder.string(), error.message()));
  if (names.empty()) {
    throw config::FileError(fmt::format("{}: no images here, must be files .png, .jpg or .jpeg", folder.string()));
  }
  return names;
}

ImageList by_names(const fs::path& folder, StampUnit unit) {
  ImageList list;
  for (const fs::path& name : images_in(folder)) {
    const auto time = parse_stamp(name.stem().string(), unit);
    if (!time) {
      throw config::FileError(fmt::format("{}: the name is '{}', must be the time, {}; or name a file of times",
                                          (folder / name).string(), name.stem().string(), stamp_forms(unit)));
    }
    list.images.push_back({folder / name, *time});
  }
  auto& images = list.images;
  std::sort(images.begin(), images.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  const auto twice =
      std::adjacent_find(images.begin(), images.end(), [](const auto& a, const auto& b) { return a.time == b.time; });
  if (twice != images.end()) {
    throw config::FileError(
        fmt::format("{} and {} have the same time, must differ", twice->file.string(), (twice + 1)->file.string()));
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
    const auto refuse = [&](const std::string& what) {
      throw config::FileError(fmt::format("{}:{}: {}", times_file.string(), line.number, what));
    };
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
      if (!entry) refuse(fmt::format("'{}' must be TIME NAME or TIME,NAME", line.text));
      refuse(fmt::format("the time is '{}', must be {}", entry->time, stamp_forms(unit)));
    }
    const fs::path name = fs::path(entry->name).filename();
    if (!there.contains(name)) {
      if (i + 1 == lines.size()) {
        leave_out(fmt::format("there is no image {}", (folder / name).string()));
        continue;
      }
      refuse(fmt::format("there is no image {}", (folder / name).string()));
    }
    if (!list.images.empty() && *time <= list.images.back().time) {
      refuse(fmt::format("the time is {}, must be later than that of the image before it", entry->time));
    }
    if (const auto [before, is_new] = named.emplace(name, line.number); !is_new) {
      refuse(fmt::format("{} stands on line {}, too; must be named once", name.string(), before->second));
    }
    list.images.push_back({folder / name, *time});
  }
  if (list.images.empty()) {
    throw config::FileError(
        fmt::format("{}: names no image, must have lines TIME NAME or TIME,NAME", times_file.string()));
  }
  if (const std::size_t others = there.size() - named.size(); others > 0) {
    list.events.push_back(
        fmt::format("{}: {} images that {} does not name are left out", folder.string(), others, times_file.string()));
  }
  return list;
}

}  // namespace

ImageList list_images(const fs::path& folder, const fs::path& times_file, StampUnit unit) {
  return times_file.empty() ? by_names(folder, unit) : by_times_file(folder, times_file, unit);
}

}  // namespace twocone::importer
