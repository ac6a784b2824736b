// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/both_runs.h"

#include <future>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "localisation/odometry.h"

// The JSON form in which a finished part is stored.
namespace twocone::vision {
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Transfer, log_gain, vignetting, tiles)

void to_json(nlohmann::json& json, const NoiseSamples::Bin& bin) { json = {bin.tiles, bin.level, bin.variance}; }
void from_json(const nlohmann::json& json, NoiseSamples::Bin& bin) { bin = {json.at(0), json.at(1), json.at(2)}; }
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(NoiseSamples, images, blocks)
}  // namespace twocone::vision

namespace twocone::compare {
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ViewImages, simulated_noise, real_noise, simulated_blur_px, real_blur_px, transfers)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Images, views, unreadable, unreadable_count)

namespace {

constexpr std::size_t kMostNamed = 5;

vision::ImageRegion region_of(const vision::MirrorView& view) {
  return {view.settings().centre_px, view.settings().rim_radius_px};
}

/// Returns `image` as the camera would show it after a turn of the robot by `turn_rad`: turned about the cone's tip.
cv::Mat turned(const cv::Mat& image, const vision::MirrorView& view, double turn_rad) {
  const Eigen::Vector2d centre = view.settings().centre_px;
  // A fixed object moves by -turn in bearing. In the image that is a turn from x towards y (down), unless the image is
  // mirrored.
  const double angle_rad = view.settings().mirrored ? turn_rad : -turn_rad;
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  const cv::Matx23d to(c, -s, centre.x() - c * centre.x() + s * centre.y(),  //
                       s, c, centre.y() - s * centre.x() - c * centre.y());
  cv::Mat result;
  cv::warpAffine(image, result, to, image.size(), cv::INTER_LINEAR);
  return result;
}

std::filesystem::path part_file(const ImageWork& work, std::size_t number) {
  return work.folder / fmt::format("{:06}.json", number);
}

/// Returns a finished part, or nothing if it is missing, damaged or of another comparison.
std::optional<Images> kept_part(const ImageWork& work, std::size_t number) {
  const auto file = part_file(work, number);
  if (!std::filesystem::exists(file)) return std::nullopt;
  try {
    const nlohmann::json json = nlohmann::json::parse(config::read_text(file));
    if (json.at("key") != work.key) return std::nullopt;
    return json.get<Images>();
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  } catch (const config::FileError&) {
    return std::nullopt;
  }
}

void append(const std::vector<double>& from, std::vector<double>& to) { to.insert(to.end(), from.begin(), from.end()); }

void merge(const Images& part, Images& all) {
  for (std::size_t v = 0; v < all.views.size(); ++v) {
    ViewImages& to = all.views[v];
    const ViewImages& from = part.views[v];
    to.simulated_noise.merge(from.simulated_noise);
    to.real_noise.merge(from.real_noise);
    append(from.simulated_blur_px, to.simulated_blur_px);
    append(from.real_blur_px, to.real_blur_px);
    to.transfers.insert(to.transfers.end(), from.transfers.begin(), from.transfers.end());
  }
  all.unreadable_count += part.unreadable_count;
  for (const std::string& text : part.unreadable) {
    if (all.unreadable.size() < kMostNamed) all.unreadable.push_back(text);
  }
}

// ---- one frame

std::optional<cv::Mat> read(const std::filesystem::path& file, Images& part) {
  auto rgb = runlog::read_rgb(file);
  if (rgb) return *std::move(rgb);
  ++part.unreadable_count;
  if (part.unreadable.size() < kMostNamed) part.unreadable.push_back(rgb.error().message);
  return std::nullopt;
}

void measure(const cv::Mat& rgb, const vision::ImageRegion& region, vision::NoiseSamples& noise,
             std::vector<double>& blurs_px) {
  noise.merge(vision::noise_samples(rgb, region));
  if (const auto blur = vision::blur_px(rgb, region)) blurs_px.push_back(*blur);
}

/// Adds a real frame with its simulated partner or, without a partner, the simulated frame at the same fraction of the
/// run.
void add(const Side& of_simulated, const Side& of_real, std::optional<std::size_t> partner, std::size_t index,
         Images& part) {
  const std::size_t simulated = partner.value_or(index * of_simulated.run.frames.size() / of_real.run.frames.size());
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const auto k = std::size_t(side);
    ViewImages& view = part.views[k];
    const vision::MirrorView &real_view = of_view(of_real.found, side),
                             &simulated_view = of_view(of_simulated.found, side);
    const auto real = read(images_of(of_real.run, index)[k], part);
    const auto rendered = read(images_of(of_simulated.run, simulated)[k], part);
    if (real) measure(*real, region_of(real_view), view.real_noise, view.real_blur_px);
    if (rendered) measure(*rendered, region_of(simulated_view), view.simulated_noise, view.simulated_blur_px);
    if (!partner || !real || !rendered || real->size() != rendered->size()) continue;
    const double turn_rad = localisation::wrap_angle_rad(of_real.reference[index]->heading_rad -
                                                         of_simulated.reference[simulated]->heading_rad);
    const auto pair = vision::transfer(turned(*rendered, simulated_view, turn_rad), *real, region_of(real_view));
    if (pair) view.transfers.push_back(*pair);
  }
}

}  // namespace

Result<Images> measure_images(const Side& simulated, const Side& real, const std::vector<Match>& by_pose,
                              const ImageWork& work) {
  std::error_code error;
  std::filesystem::create_directories(work.folder, error);
  if (error) throw runlog::DiskError("cannot make {}: {}", work.folder.string(), error.message());
  std::vector<std::optional<std::size_t>> partners(real.run.frames.size());
  for (const Match& match : by_pose) partners[match.real] = match.simulated;
  const auto every = std::size_t(work.every);
  const std::size_t frames = (real.run.frames.size() + every - 1) / every;
  const std::size_t parts = (frames + kPartFrames - 1) / kPartFrames;
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;  // protects `done`
  std::size_t done = 0;
  const auto is_stopped = [&work] { return work.stop != nullptr && *work.stop; };
  const auto labour = [&] {
    for (std::size_t number = next++; number < parts && !is_stopped(); number = next++) {
      try {
        if (!kept_part(work, number)) {
          Images part;
          for (std::size_t i = number * kPartFrames; i < std::min(frames, (number + 1) * kPartFrames); ++i) {
            add(simulated, real, partners[i * every], i * every, part);
          }
          nlohmann::json json = part;
          json["key"] = work.key;
          runlog::write_whole(part_file(work, number), json.dump());
        }
      } catch (...) {
        next = parts;
        throw;
      }
      const std::lock_guard lock(mutex);
      ++done;
      if (work.progress) work.progress(double(done) / double(parts));
    }
  };
  std::vector<std::future<void>> workers(std::size_t(work.jobs));
  for (auto& worker : workers) worker = std::async(std::launch::async, labour);
  for (auto& worker : workers) worker.get();
  if (is_stopped()) return stopped_error();
  Images all;
  for (std::size_t number = 0; number < parts; ++number) {
    const auto part = kept_part(work, number);
    if (!part) throw runlog::DiskError("{}: does not contain what was written", part_file(work, number).string());
    merge(*part, all);
  }
  return all;
}

}  // namespace twocone::compare
