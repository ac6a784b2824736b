// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/truth_files.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <iterator>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::runlog {
namespace {

constexpr std::array kEndings{"object.png", "distance.npy", "normal.npy"};

std::filesystem::path truth_file(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame,
                                 const char* ending) {
  return run / "truth" / fmt::format("{}_{:06}_{}", camera, frame, ending);
}

/// Returns an array file of NumPy, format 1.0. @param shape for example "480, 640"
std::string npy(const std::string& shape, std::span<const float> values) {
  static_assert(std::endian::native == std::endian::little, "the numbers are written as they are in memory");
  constexpr std::string_view kMagic("\x93NUMPY\x01\x00", 8);
  constexpr std::size_t kBlock = 64;  // the values begin at a multiple of it
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}), }}", shape);
  const std::size_t before = kMagic.size() + 2 + header.size() + 1;
  header.append((kBlock - before % kBlock) % kBlock, ' ');
  header += '\n';
  std::string file(kMagic);
  file += static_cast<char>(header.size() % 256);
  file += static_cast<char>(header.size() / 256);
  file += header;
  file.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  return file;
}

bool is_within(const sim_povray::TrueBox& box, const Landmark& landmark) {
  constexpr double kSlack_m = 0.001;
  const double reach_m = landmark.radius_m + kSlack_m;
  return box.low_m[0] >= landmark.x_m - reach_m && box.high_m[0] <= landmark.x_m + reach_m &&
         box.low_m[1] >= landmark.y_m - reach_m && box.high_m[1] <= landmark.y_m + reach_m &&
         box.low_m[2] >= -kSlack_m && box.high_m[2] <= landmark.top_m + kSlack_m;
}

}  // namespace

void write_truth(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame,
                 const sim_povray::PixelTruth& truth) {
  make_folder(run / "truth");
  write_grey16(truth_file(run, camera, frame, kEndings[0]), truth.width_px, truth.height_px, truth.object);
  const auto write = [&](const char* ending, std::string_view content) {
    write_whole(truth_file(run, camera, frame, ending), content);
  };
  const std::string shape = fmt::format("{}, {}", truth.height_px, truth.width_px);
  write(kEndings[1], npy(shape, truth.distance_m));
  write(kEndings[2], npy(shape + ", 3", {truth.normal.data()->data(), 3 * truth.normal.size()}));
}

bool has_truth(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame) {
  return std::ranges::all_of(
      kEndings, [&](const char* ending) { return std::filesystem::exists(truth_file(run, camera, frame, ending)); });
}

void write_true_objects(const std::filesystem::path& run, const std::vector<sim_povray::TrueObject>& objects,
                        const std::vector<Landmark>& landmarks) {
  make_folder(run / "truth");
  std::string text = "number,kind,name,landmark,file,line\n";
  for (const sim_povray::TrueObject& object : objects) {
    const auto landmark = std::ranges::find_if(
        landmarks, [&](const Landmark& of_map) { return object.box && is_within(*object.box, of_map); });
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{}\n", object.number, object.kind, to_field(object.name),
                   landmark == landmarks.end() ? std::string() : to_field(landmark->name), to_field(object.file),
                   object.line);
  }
  write_whole(run / "truth" / "objects.csv", text);
}

}  // namespace twocone::runlog
