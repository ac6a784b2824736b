// SPDX-License-Identifier: Apache-2.0
#include "bench/many_frames.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <exception>
#include <fstream>
#include <memory>
#include <mutex>
#include <random>
#include <sstream>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/estimator.h"
#include "apps/runlog/answer_rows.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/summary/bounds.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/version.h"
#include "base/hash.h"
#include "base/quantile.h"
#include "bench/robot_scene.h"
#include "drivers/sim_povray/camera/camera_stage.h"
#include "tests/support/value.h"

namespace twocone::bench {
namespace {

using testing_support::value;

/// Reads a value of type T from a field, or nothing from an empty one.
template <class T>
std::optional<T> parsed(const std::string& field) {
  T number{};
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return number;
}

std::string field_of(const std::optional<double>& number) { return number ? fmt::format("{}", *number) : ""; }

std::string line_of(const FixRecord& r) {
  const char* const held = !r.in_ellipse ? "" : *r.in_ellipse ? "1" : "0";
  return fmt::format("{},{},{},{},{},{},{},{},{},{}\n", r.frame, r.truth.x_m, r.truth.y_m, r.truth.heading_rad,
                     r.verdict, field_of(r.error_m), held, field_of(r.bound_m), r.render_s, r.vision_s);
}

/// Returns nothing for a line that was cut off.
std::optional<FixRecord> record_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line + ',');
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  if (fields.size() != 10) return std::nullopt;
  const auto frame = parsed<int>(fields[0]);
  const auto x_m = parsed<double>(fields[1]), y_m = parsed<double>(fields[2]), heading_rad = parsed<double>(fields[3]);
  const auto render_s = parsed<double>(fields[8]), vision_s = parsed<double>(fields[9]);
  if (!frame || !x_m || !y_m || !heading_rad || !render_s || !vision_s) return std::nullopt;
  FixRecord record{*frame, {*x_m, *y_m, *heading_rad}, fields[4], parsed<double>(fields[5]),
                   {},     parsed<double>(fields[7]),  *render_s, *vision_s};
  if (!fields[6].empty()) record.in_ellipse = fields[6] == "1";
  return record;
}

/// The file of rows: a line that says which frames they are, then one for each frame.
class Rows {
 public:
  Rows(const std::filesystem::path& file, const std::string& head, int frames) {
    if (file.empty()) return;
    std::map<int, std::vector<FixRecord>> found;
    if (std::ifstream in(file); in) {
      std::string line;
      std::getline(in, line);
      if (line != head) {
        throw std::runtime_error(
            fmt::format("{}: holds other frames ({}); remove it, or name another file", file.string(), line));
      }
      while (std::getline(in, line)) {
        const auto record = record_of(line);
        if (record && !in.eof()) found[record->frame / kFramesOfBlock].push_back(*record);
      }
    }
    for (auto& [block, records] : found) {
      const int wanted = std::min(kFramesOfBlock, frames - block * kFramesOfBlock);
      if (int(records.size()) > wanted) {
        throw std::runtime_error(
            fmt::format("{}: holds more than {} frames; name another file", file.string(), frames));
      }
      // With fewer frames, the last block had another bound.
      if (int(records.size()) == wanted) blocks_[block] = std::move(records);
    }
    // Half a block is left out.
    std::string text = head + '\n';
    for (const auto& [block, records] : blocks_) {
      for (const FixRecord& record : records) text += line_of(record);
    }
    runlog::write_whole(file, text);
    out_.open(file, std::ios::app);
    if (!out_) throw std::runtime_error(fmt::format("{}: cannot be written", file.string()));
  }

  [[nodiscard]] bool has(int block) const {
    const std::lock_guard lock(mutex_);
    return blocks_.contains(block);
  }
  void add(int block, std::vector<FixRecord> records) {
    std::string text;
    for (const FixRecord& record : records) text += line_of(record);
    const std::lock_guard lock(mutex_);
    if (out_.is_open() && !(out_ << text << std::flush)) throw std::runtime_error("the rows cannot be written");
    blocks_[block] = std::move(records);
  }
  /// Returns the records of all blocks, in order. All threads have ended.
  [[nodiscard]] std::vector<FixRecord> all() const {
    std::vector<FixRecord> result;
    for (const auto& [block, records] : blocks_) result.insert(result.end(), records.begin(), records.end());
    return result;
  }

 private:
  std::ofstream out_;
  mutable std::mutex mutex_;  // of what add() changes
  std::map<int, std::vector<FixRecord>> blocks_;
};

/// Compares a position and its covariance with the truth.
void judge(const localisation::Fix& fix, const Pose2& truth, FixRecord& record) {
  const Eigen::Vector2d error_m = *fix.position_m - Eigen::Vector2d(truth.x_m, truth.y_m);
  record.error_m = error_m.norm();
  if (!fix.covariance) return;
  const Eigen::LLT<Eigen::Matrix2d> factor(fix.covariance->topLeftCorner<2, 2>());
  record.in_ellipse =
      factor.info() == Eigen::Success && factor.matrixL().solve(error_m).squaredNorm() <= runlog::k95Ellipse;
}

class FrameTaker {
 public:
  FrameTaker(const config::Robot& robot, const ManyFramesOptions& options)
      : robot_(robot),
        options_(options),
        settings_(config::to_robot_settings(robot, config::read_map(robot.map), 1)),
        scene_(robot, {settings_.lower.settings.width_px, settings_.lower.settings.height_px,
                       options.antialias.value_or(settings_.lower.antialias)}) {
    if (!scene_.obstacle().empty()) throw std::runtime_error("only POV-Ray renders this: " + scene_.obstacle());
    const CameraSettings &lower = settings_.lower.settings, &upper = settings_.upper.settings;
    if (lower.width_px != upper.width_px || lower.height_px != upper.height_px ||
        settings_.lower.antialias != settings_.upper.antialias) {
      throw std::runtime_error(robot.file.string() + ": both cameras must have images of one kind");
    }
    if (sim_povray::takes_time(settings_.lower.effects) || sim_povray::takes_time(settings_.upper.effects)) {
      throw std::runtime_error(robot.file.string() + ": exposures must take no time, because the robot does not move");
    }
  }

  /// Returns the records of a block. @param estimator of the calling thread
  [[nodiscard]] std::vector<FixRecord> block(int number, const estimation::Estimator& estimator) const {
    const int begin = number * kFramesOfBlock;
    const int end = std::min(begin + kFramesOfBlock, options_.frames);
    runlog::RunData run;
    run.robot = robot_;
    run.map = scene_.map();
    std::vector<FixRecord> records;
    for (int frame = begin; frame < end; ++frame) records.push_back(one(frame, estimator, run));
    const auto bounds = runlog::bounds(run);
    for (std::size_t i = 0; i < bounds.size(); ++i) {
      if (const auto& c = bounds[i].covariance) records[i].bound_m = std::sqrt((*c)(0, 0) + (*c)(1, 1));
    }
    return records;
  }

 private:
  FixRecord one(int frame, const estimation::Estimator& estimator, runlog::RunData& run) const {
    std::seed_seq seeds{options_.seed, std::uint64_t(frame)};
    std::mt19937_64 random(seeds);
    const Pose2 truth = scene_.free_pose(random);
    const double begin_s = estimation::thread_time_s();
    const std::string pose = scene_.text_of(truth);
    const Image lower = image(0, settings_.lower.effects, pose, frame);
    const Image upper = image(1, settings_.upper.effects, pose, frame);
    const double rendered_s = estimation::thread_time_s();
    const auto answer = value(estimator.answer(lower, upper));
    FixRecord record{
        .frame = frame, .truth = truth, .verdict = std::string(localisation::to_string(answer.fix.verdict))};
    record.render_s = rendered_s - begin_s;
    record.vision_s = estimation::thread_time_s() - rendered_s;
    if (is_place(answer.fix)) judge(answer.fix, truth, record);
    const double t_s = frame;
    run.frames.push_back({.frame = std::uint64_t(frame), .t_s = t_s});
    run.truth.push_back({t_s, truth.x_m, truth.y_m, truth.heading_rad});
    const auto rows = runlog::to_rows(std::uint64_t(frame), t_s, answer, run.map, nullptr);
    run.sightings.insert(run.sightings.end(), rows.sightings.begin(), rows.sightings.end());
    return record;
  }

  [[nodiscard]] Image image(std::size_t view, const sim_povray::CameraEffects& effects, const std::string& pose,
                            int frame) const {
    Image light = rendered(*scene_.views()[view].native, pose);
    if (!sim_povray::changes_pixels(effects)) return light;
    const std::chrono::duration<double> time(frame / robot_.lower.settings.rate_hz);
    return sim_povray::develop(effects, {std::make_shared<const Image>(std::move(light))}, options_.seed,
                               view == 0 ? "lower" : "upper", std::uint64_t(frame),
                               std::chrono::round<std::chrono::nanoseconds>(time));
  }

  const config::Robot& robot_;
  const ManyFramesOptions& options_;
  const drivers::RobotSettings settings_;
  const RobotScene scene_;
};

/// Returns a digest of the files that the frames are made from.
std::uint64_t inputs(const config::Robot& robot) {
  const config::Map map = config::read_map(robot.map);
  std::string text = config::read_text(robot.file) + config::read_text(map.file);
  for (const auto& [file, digest] : runlog::scene_files(map)) text += digest;
  return base::fnv1a(text);
}

/// Returns Wilson's interval of a share, at 95 %.
std::pair<double, double> wilson(int held, int count) {
  const double n = count, p = held / n, z2 = runlog::k95Sigmas * runlog::k95Sigmas;
  const double middle = (p + z2 / (2 * n)) / (1 + z2 / n);
  const double half = runlog::k95Sigmas * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n)) / (1 + z2 / n);
  return {middle - half, middle + half};
}

}  // namespace

std::vector<FixRecord> take_frames(const config::Robot& robot, const ManyFramesOptions& options) {
  const std::string head =
      fmt::format("{}, files {:016x}, seed {}, rays {}, twocone {} {}, {}", robot.file.string(), inputs(robot),
                  options.seed, options.antialias ? std::to_string(*options.antialias) : "of the file",
                  runlog::version(), runlog::commit(), runlog::compiler());
  Rows rows(options.rows, head, options.frames);
  const int blocks = (options.frames + kFramesOfBlock - 1) / kFramesOfBlock;
  int first = 0;
  while (first < blocks && rows.has(first)) ++first;
  if (first == blocks) return rows.all();
  const FrameTaker taker(robot, options);  // finds the mirrors, which takes seconds
  std::atomic<int> next = first;
  std::exception_ptr failure;
  std::mutex mutex;  // of failure
  {
    std::vector<std::jthread> threads;
    threads.reserve(std::size_t(options.threads));
    for (int i = 0; i < options.threads; ++i) {
      threads.emplace_back([&] {
        try {
          const estimation::Estimator estimator(estimation::Method::kOutline, robot, config::read_map(robot.map));
          for (int block = next++; block < blocks; block = next++) {
            if (rows.has(block)) continue;
            auto records = taker.block(block, estimator);
            const int taken = int(records.size());
            rows.add(block, std::move(records));
            if (options.progress) options.progress(taken);
          }
        } catch (...) {
          next = blocks;
          const std::lock_guard lock(mutex);
          failure = std::current_exception();
        }
      });
    }
  }
  if (failure) std::rethrow_exception(failure);
  return rows.all();
}

FixStatistics statistics_of(const std::vector<FixRecord>& records) {
  FixStatistics s;
  s.frames = int(records.size());
  std::vector<double> errors_m;
  double sum_m = 0, squares = 0, bounded_squares = 0, bound_squares = 0;
  for (const FixRecord& r : records) {
    ++s.verdicts[r.verdict];
    s.render_s += r.render_s / s.frames;
    s.vision_s += r.vision_s / s.frames;
    if (r.in_ellipse) {
      ++s.with_ellipse;
      s.in_ellipse += *r.in_ellipse ? 1 : 0;
    }
    if (!r.error_m) continue;
    errors_m.push_back(*r.error_m);
    sum_m += *r.error_m;
    squares += *r.error_m * *r.error_m;
    if (!r.bound_m) continue;
    ++s.with_bound;
    bound_squares += *r.bound_m * *r.bound_m;
    bounded_squares += *r.error_m * *r.error_m;
  }
  s.with_fix = int(errors_m.size());
  if (s.with_ellipse > 0) {
    s.coverage = double(s.in_ellipse) / s.with_ellipse;
    std::tie(s.coverage_low, s.coverage_high) = wilson(s.in_ellipse, s.with_ellipse);
  }
  if (s.with_bound > 0) {
    s.bound_rms_m = std::sqrt(bound_squares / s.with_bound);
    s.rmse_of_bounded_m = std::sqrt(bounded_squares / s.with_bound);
  }
  if (errors_m.empty()) return s;
  const double n = s.with_fix;
  s.mean_m = sum_m / n;
  s.rmse_m = std::sqrt(squares / n);
  // The errors of independent poses: their mean is nearly normal for so many.
  s.mean_half_width_m = n < 2 ? 0 : runlog::k95Sigmas * std::sqrt((squares / n - s.mean_m * s.mean_m) / (n - 1));
  s.max_m = *std::max_element(errors_m.begin(), errors_m.end());
  for (const double share : {0.5, 0.9, 0.95, 0.99, 0.999}) s.quantiles_m[share] = base::quantile(errors_m, share);
  return s;
}

}  // namespace twocone::bench
