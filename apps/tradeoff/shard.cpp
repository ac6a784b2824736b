// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/shard.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "apps/runlog/answer_rows.h"
#include "apps/runlog/summary/bounds.h"
#include "apps/runlog/summary/summary.h"
#include "base/child_process.h"
#include "drivers/sim_povray/simulation.h"
#include "drivers/sim_povray/simulation_host.h"
#include "localisation/odometry.h"

namespace twocone::tradeoff {
namespace {

/// Time limit for a step, and for an image, on a machine that is busy with other programs.
constexpr std::chrono::milliseconds kTimeout{600'000};
/// Share of rendering in a shard's progress.
constexpr double kRenderingShare = 0.9;

/// One frame of an episode, with the robot's images and the true pose.
struct Shot {
  int episode = 0, step = 0;
  Pose2 truth;
  WheelAngles angles;
  double t_s = 0;
  Frame lower, upper;
  std::shared_ptr<const Image> lower_image{}, upper_image{};
};

/// Costs of rendering, which other threads report. The object must live until the last image is complete.
struct RenderCosts {
  std::mutex mutex;
  std::map<std::pair<int, int>, double> cpu_s;  ///< of episode and step
  double peak_bytes = 0;

  void add(int episode, const sim_povray::RenderedImage& image) {
    const std::lock_guard lock(mutex);
    cpu_s[{episode, int(image.step)}] += std::chrono::duration<double>(image.cpu).count();
    peak_bytes = std::max(peak_bytes, double(image.peak_bytes));
  }
};

/// Resets the peak of this process's resident memory, of which the kernel keeps one value for each process.
/// @returns false if the kernel does not allow it
bool reset_peak_memory() {
  std::ofstream mark("/proc/self/clear_refs");
  mark << "5" << std::flush;  // proc(5): sets the peak to the present resident size
  return bool(mark);
}

/// Reduces a setting to the values that determine its answer for a frame.
Setting recipe_of(const Setting& s) {
  return {.level = s.level, .enough_m = s.enough_m, .landmarks = s.landmarks, .bearings = s.bearings};
}

/// The answers of a recipe for every shot.
struct Answers {
  std::vector<estimation::FrameAnswer> frames;
  double peak_bytes = 0;
};

void judge(const std::optional<Eigen::Vector2d>& position_m, std::optional<double> heading_rad,
           const std::optional<Eigen::Matrix3d>& covariance, const Pose2& truth, FrameRow& row) {
  if (!position_m) return;
  const Eigen::Vector2d error = *position_m - Eigen::Vector2d(truth.x_m, truth.y_m);
  row.error_m = error.norm();
  if (heading_rad) row.heading_error_rad = std::abs(localisation::wrap_angle_rad(*heading_rad - truth.heading_rad));
  if (!covariance) return;
  const Eigen::LLT<Eigen::Matrix2d> factor(covariance->topLeftCorner<2, 2>());
  row.in_ellipse = factor.info() == Eigen::Success && factor.matrixL().solve(error).squaredNorm() <= runlog::k95Ellipse;
}

/// Propagates `covariance` of a pose from pose `from` to pose `to`. The motion between both is known exactly.
Eigen::Matrix3d moved(const Eigen::Matrix3d& covariance, const Pose2& from, const Pose2& to) {
  Eigen::Matrix3d by_pose = Eigen::Matrix3d::Identity();
  by_pose(0, 2) = -(to.y_m - from.y_m);
  by_pose(1, 2) = to.x_m - from.x_m;
  return by_pose * covariance * by_pose.transpose();
}

/// The bound of the pose for each shot; empty if no outline was measured.
using Bounds = std::vector<std::optional<Eigen::Matrix3d>>;

class ShardRunner {
 public:
  ShardRunner(config::Robot robot, config::Map map, const Plan& plan, sim_povray::RenderSettings render)
      : robot_(std::move(robot)), map_(std::move(map)), plan_(plan), render_(std::move(render)) {}

  Result<ShardRecord> run(std::size_t number, const std::function<void(double)>& progress,
                          const std::atomic<bool>& stop) {
    const Plan::Shard& shard = plan_.shards.at(number);
    auto shots = take(shard, progress, stop);
    if (!shots) return shots.error();
    ShardRecord record;
    const auto first = int(first_of(plan_, shard.images));
    {
      const std::lock_guard lock(costs_->mutex);
      for (const auto& [place, cpu_s] : costs_->cpu_s) {
        record.renders.push_back({first, place.first, place.second, cpu_s});
      }
      record.render_memory.push_back({first, costs_->peak_bytes});
    }

    std::map<Setting, Answers> answers;
    for (const Setting& setting : plan_.settings) {
      if (setting.images != shard.images || answers.contains(recipe_of(setting))) continue;
      if (stop) return stopped();
      auto made = answer_all(setting, *shots);
      if (!made) return made.error();
      answers.emplace(recipe_of(setting), *std::move(made));
    }
    const auto bounds = bounds_of(shard.images, *shots, answers);
    for (std::size_t i = 0; i < plan_.settings.size(); ++i) {
      const Setting& setting = plan_.settings[i];
      if (setting.images != shard.images) continue;
      const Answers& made = answers.at(recipe_of(setting));
      if (setting.frames == 1) {
        judge_frames(int(i), *shots, made, bounds, record);
      } else {
        judge_estimates(int(i), setting, *shots, made, bounds, record);
      }
      if (made.peak_bytes > 0) record.memory.push_back({int(i), made.peak_bytes});
    }
    progress(1);
    return record;
  }

 private:
  static Error stopped() { return {ErrorCode::kCancelled, "stopped from outside"}; }

  /// Returns the most accurate setting, whose outlines give the bound its noise.
  [[nodiscard]] Setting finest_of(const Images& images) const {
    return {.images = images, .landmarks = int(plan_.landmarks.size()), .rate_hz = plan_.robot_rate_hz};
  }

  /// Opens the world for these images, once for all consecutive shards with the same images.
  Status open(const Images& images) {
    if (host_ && images_ == images) return {};
    host_.reset();
    const Setting setting = finest_of(images);
    settings_ = config::to_robot_settings(robot_of(setting, robot_, plan_.landmarks), map_of(setting, map_), 1);
    const sim_povray::RendererKind renderer = settings_->world->place.render.renderer;
    settings_->world->place.render = render_;
    settings_->world->place.render.renderer = renderer;
    auto host = sim_povray::SimulationHost::open(settings_->world->place);
    if (!host) return host.error();
    host_ = *std::move(host);
    images_ = images;
    return {};
  }

  /// Drives an episode; the images may still be rendering when this returns.
  Status drive(int number, std::vector<Shot>& shots) {
    const Episode& episode = plan_.episodes[std::size_t(number)];
    sim_povray::SessionSettings session = settings_->world->session;
    session.drive = settings_->drive.limits;
    session.body.begin = episode.from;
    session.body.seed = episode.seed;
    session.run_ahead_frames = kStepsOfEpisode + 1;
    session.rendered = [costs = costs_, number](const sim_povray::RenderedImage& p) { costs->add(number, p); };
    if (auto empty = host_->reset(); !empty) return empty.error();
    auto simulation = sim_povray::Simulation::join(*host_, session);
    if (!simulation) return simulation.error();
    const auto views = config::to_views(*settings_);
    std::vector<std::unique_ptr<Camera>> cameras;
    for (const auto& [view, part] : {std::pair{&views[0], &settings_->lower}, {&views[1], &settings_->upper}}) {
      auto camera = (*simulation)->open_camera(*view);
      if (!camera) return camera.error();
      if (auto applied = (*camera)->configure(part->settings); !applied) return applied.error();
      if (auto started = (*camera)->start(); !started) return started.error();
      cameras.push_back(*std::move(camera));
    }
    const auto wheels = (*simulation)->open_drive();
    const auto truth = (*simulation)->open_truth();
    for (int i = 0; i < kStepsOfEpisode; ++i) {
      auto lower = cameras[0]->grab(kTimeout);
      if (!lower) return lower.error();
      auto upper = cameras[1]->grab(kTimeout);
      if (!upper) return upper.error();
      const auto angles = wheels->read_angles();
      if (!angles) return angles.error();
      const double t_s = lower->header().captured.seconds();
      shots.push_back({number, i, truth->true_pose(), *angles, t_s, *std::move(lower), *std::move(upper)});
      if (auto driving = wheels->set_speeds(episode.speeds); !driving) return driving.error();
    }
    return {};
  }

  Result<std::vector<Shot>> take(const Plan::Shard& shard, const std::function<void(double)>& progress,
                                 const std::atomic<bool>& stop) {
    costs_ = std::make_shared<RenderCosts>();
    if (auto opened = open(shard.images); !opened) return opened.error();
    std::vector<Shot> shots;
    for (int episode = shard.first_episode; episode < shard.first_episode + shard.episodes; ++episode) {
      if (auto driven = drive(episode, shots); !driven)
        return with_name(fmt::format("episode {}", episode), driven.error());
    }
    for (std::size_t i = 0; i < shots.size(); ++i) {
      if (stop) return stopped();
      Shot& shot = shots[i];
      for (const auto& [frame, image] : {std::pair{&shot.lower, &shot.lower_image}, {&shot.upper, &shot.upper_image}}) {
        auto finished = frame->image(kTimeout);
        if (!finished) return with_name(fmt::format("episode {}", shot.episode), finished.error());
        *image = *std::move(finished);
      }
      progress(kRenderingShare * double(i + 1) / double(shots.size()));
    }
    return shots;
  }

  [[nodiscard]] Result<Answers> answer_all(const Setting& setting, const std::vector<Shot>& shots) const {
    const estimation::Estimator estimator(method_of(setting.level), robot_of(setting, robot_, plan_.landmarks),
                                          map_of(setting, map_));
    Answers answers;
    // One answer is computed before the timed ones, because the first use creates objects that are used again later.
    if (auto warmed = estimator.answer(*shots[0].lower_image, *shots[0].upper_image); !warmed) return warmed.error();
    const bool is_reset = reset_peak_memory();
    for (const Shot& shot : shots) {
      auto answer = estimator.answer(*shot.lower_image, *shot.upper_image);
      if (!answer) return with_name(fmt::format("episode {}", shot.episode), answer.error());
      answers.frames.push_back(*std::move(answer));
    }
    // A robot has only one pair of images in memory, so the others are subtracted.
    const double pair_bytes = double(shots[0].lower_image->bytes.size() + shots[0].upper_image->bytes.size());
    const double bytes = is_reset ? double(base::peak_memory_bytes(::getpid())) : 0;
    if (bytes > 0) answers.peak_bytes = bytes - double(shots.size() - 1) * pair_bytes;
    return answers;
  }

  [[nodiscard]] Bounds bounds_of(const Images& images, const std::vector<Shot>& shots,
                                 const std::map<Setting, Answers>& answers) const {
    const Setting finest = finest_of(images);
    runlog::RunData run;
    run.robot = robot_of(finest, robot_, plan_.landmarks);
    run.map = map_of(finest, map_);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const Pose2& truth = shots[i].truth;
      const double t_s = double(i);  // not the shot's own time, because all episodes begin at the same time
      run.frames.push_back({.frame = i, .t_s = t_s});
      run.truth.push_back({t_s, truth.x_m, truth.y_m, truth.heading_rad});
    }
    const auto made = answers.find(recipe_of(finest));
    if (made != answers.end()) {
      for (std::size_t i = 0; i < shots.size(); ++i) {
        const auto rows = runlog::to_rows(i, double(i), made->second.frames[i], run.map, nullptr);
        run.sightings.insert(run.sightings.end(), rows.sightings.begin(), rows.sightings.end());
      }
    }
    Bounds result(shots.size());
    const auto bounds = runlog::bounds(run);
    for (std::size_t i = 0; i < bounds.size(); ++i) result[i] = bounds[i].covariance;
    return result;
  }

  void judge_frames(int setting, const std::vector<Shot>& shots, const Answers& made, const Bounds& bounds,
                    ShardRecord& record) const {
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const Shot& shot = shots[i];
      const estimation::FrameAnswer& answer = made.frames[i];
      FrameRow row = row_of(setting, shot, answer);
      row.verdict = localisation::to_string(answer.fix.verdict);
      if (!answer.fix.other_position_m && answer.fix.verdict != localisation::FixVerdict::kOutOfBounds) {
        judge(answer.fix.position_m, answer.fix.heading_rad, answer.fix.covariance, shot.truth, row);
      }
      if (bounds[i]) row.bound_m = std::sqrt((*bounds[i])(0, 0) + (*bounds[i])(1, 1));
      record.frames.push_back(std::move(row));
      for (std::size_t k = 0; k < answer.ranges.size(); ++k) {
        if (!answer.ranges[k].range_m) continue;
        const config::Landmark& landmark = map_.landmarks[k];
        const double true_m = std::hypot(landmark.x_m - shot.truth.x_m, landmark.y_m - shot.truth.y_m);
        record.ranges.push_back({setting, shot.episode, shot.step, std::abs(*answer.ranges[k].range_m - true_m)});
      }
    }
  }

  /// Adds one answer for each episode: the filter's estimate at the last frame. The filter starts at the first one.
  void judge_estimates(int number, const Setting& setting, const std::vector<Shot>& shots, const Answers& made,
                       const Bounds& bounds, ShardRecord& record) const {
    const auto steps = steps_of(setting, plan_.robot_rate_hz);
    for (std::size_t episode = 0; episode < shots.size(); episode += kStepsOfEpisode) {
      estimation::Track track(estimation::Method::kOutline, robot_, map_);
      const Shot& last = shots[episode + std::size_t(steps.back())];
      Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
      for (const int step : steps) {
        const std::size_t i = episode + std::size_t(step);
        const Shot& shot = shots[i];
        FrameRow row = row_of(number, shot, made.frames[i]);
        const double begin_s = estimation::thread_time_s();
        const auto estimate =
            track.follow(shot.t_s, shot.angles.left_rad, shot.angles.right_rad, 0, made.frames[i].fix);
        row.localisation_s += estimation::thread_time_s() - begin_s;
        if (bounds[i]) information += moved(*bounds[i], shot.truth, last.truth).inverse();
        if (step == steps.back()) {
          row.verdict = estimate.position_m ? "ok" : "no_estimate";
          judge(estimate.position_m, estimate.heading_rad, estimate.covariance, shot.truth, row);
          const Eigen::LDLT<Eigen::Matrix3d> factor(information);
          if (factor.info() == Eigen::Success && factor.isPositive() && factor.rcond() > 0) {
            const Eigen::Matrix3d bound = factor.solve(Eigen::Matrix3d::Identity());
            row.bound_m = std::sqrt(bound(0, 0) + bound(1, 1));
          }
        }
        record.frames.push_back(std::move(row));
      }
    }
  }

  static FrameRow row_of(int setting, const Shot& shot, const estimation::FrameAnswer& answer) {
    return {.setting = setting,
            .episode = shot.episode,
            .step = shot.step,
            .vision_s = answer.timing.vision_s,
            .localisation_s = answer.timing.localisation_s};
  }

  const config::Robot robot_;
  const config::Map map_;
  const Plan& plan_;
  const sim_povray::RenderSettings render_;
  std::shared_ptr<sim_povray::SimulationHost> host_;
  Images images_;
  std::optional<drivers::RobotSettings> settings_;
  std::shared_ptr<RenderCosts> costs_;
};

}  // namespace

RunShard shard_runner(const config::Robot& robot, const config::Map& map, const Plan& plan,
                      const sim_povray::RenderSettings& render) {
  const auto runner = std::make_shared<ShardRunner>(robot, map, plan, render);
  return [runner](std::size_t shard, const std::function<void(double)>& progress, const std::atomic<bool>& stop) {
    return runner->run(shard, progress, stop);
  };
}

}  // namespace twocone::tradeoff
