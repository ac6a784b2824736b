// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <sys/resource.h>

#include <algorithm>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/scanner.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/tables/truth_files.h"
#include "apps/runs/loop/frame_answers.h"
#include "apps/runs/loop/frame_taker.h"
#include "apps/runs/loop/real_time.h"
#include "apps/runs/loop/run_record.h"
#include "apps/runs/loop/start_check.h"
#include "apps/runs/loop/steering.h"
#include "apps/runs/loop/truth_collector.h"
#include "apps/runs/self_rig.h"
#include "base/errors.h"
#include "base/log.h"
#include "drivers/sim_povray/effects.h"

namespace twocone::runs {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

// A world that is starting can be reached well within a second; a loaded machine takes longer.
constexpr std::chrono::milliseconds kServingTimeout{5'000};
constexpr std::chrono::milliseconds kBetweenCalls{100};

double cpu_seconds(int of) {
  rusage usage{};
  ::getrusage(of, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::vector<Disc> discs_of(const std::vector<estimation::MappedLandmark>& found) {
  std::vector<Disc> discs;
  discs.reserve(found.size());
  for (const estimation::MappedLandmark& l : found) {
    discs.push_back({{l.landmark.x_m, l.landmark.y_m}, l.landmark.radius_m});
  }
  return discs;
}

/// Performs one run, from opening the robot to writing the last table.
class Loop {
 public:
  Loop(const config::Robot& robot, const config::Map& map, const RunOptions& options, const Progress& progress,
       const std::atomic<bool>& stop)
      : robot_(robot),
        map_(map),
        options_(options),
        progress_(progress),
        stop_(stop),
        record_(robot, map, options),
        steering_(robot, options.maps ? estimation::without_landmarks(map) : map, options.behaviour, options.seed,
                  options.remote, options.controller, [this](const auto& event) { record_.note(event); }),
        answers_(robot, map, options.method, options.maps) {
    if (options.behaviour == "explore") scanner_.emplace(robot, map);
    if (!answers_.why_no_baseline().empty()) record_.note("no baseline: " + answers_.why_no_baseline());
  }

  Result<runlog::RunInfo> go() {
    if (options_.replace) runlog::check_replaceable(options_.out);  // before the robot starts
    drivers::RobotSettings settings = config::to_robot_settings(robot_, map_, options_.seed);
    if (options_.truth && (!settings.world || !settings.world->attach.empty())) {
      return Error(ErrorCode::kRefused,
                   "{}: --truth needs a simulated world inside this program: only that knows where everything is",
                   robot_.file.string());
    }
    if (settings.world) {
      if (auto prepared = prepare_world(settings); !prepared) return prepared.error();
    }
    auto opened = open(settings);
    if (!opened) return opened.error();
    if (options_.real_time && !opened->pace().waits_for_program) {
      return Error(ErrorCode::kRefused, "{}: --real-time is for simulated robots: real devices set the pace themselves",
                   robot_.file.string());
    }
    if (options_.replace) runlog::remove_run(options_.out);
    record_.open();
    if (options_.opened) options_.opened(record_.info());
    if (const std::string notice = opened->pace().notice; !notice.empty() && options_.notify) {
      options_.notify(fmt::format("{} frames; {}", options_.frames, notice));
    }
    Status done;
    {
      Robot robot = std::move(*opened);
      done = drive(robot, settings);
      robot.stop();
      note_capture(robot);
    }  // Here the programs that a simulation started have ended, so their processor time is known.
    return end(done);
  }

 private:
  /// Prepares a simulated world before it is opened.
  Status prepare_world(drivers::RobotSettings& settings) {
    drivers::SimulatedWorld& world = *settings.world;
    const bool is_served = !world.attach.empty();
    if (map_.scene && !is_served) record_.info().scene_files = runlog::scene_files(map_);
    if (options_.old == runlog::OldLines::kKeep) {
      // The world is driven again from its start, and the cameras return the stored images.
      const runlog::StoredImages stored(options_.out, options_.truth);
      record_.set_replayed(stored.frames());
      clock_before_s_ = stored.last_host_t_s();
      world.session.stored = stored;
      record_.info().renderer = options_.rendered_before;
      record_.info().events.push_back(fmt::format("resumed after {} frames that were there", stored.frames()));
    }
    sim_povray::KeyPlaces places;
    try {
      places = config::key_places(robot_, map_);
    } catch (const config::FileError&) {  // a program made this robot without a file
      if (!is_served) throw;
    }
    const auto start = places.find("start");
    const std::string start_place = start != places.end() ? start->second : robot_.file.string();
    world.session.body.start_place = start_place;
    if (options_.renderer) world.place.render.renderer = *options_.renderer;
    if (world.place.render.renderer == sim_povray::RendererKind::kPovray && options_.truth) {
      return Error{ErrorCode::kRefused,
                   "--truth needs the native renderer, and the map or --renderer says that POV-Ray renders"};
    }
    if (options_.truth) {
      world.session.truth = [this](const std::string& camera, std::uint64_t step, sim_povray::PixelTruth truth) {
        truth_.put(camera, step, std::move(truth));
      };
    }
    world.place.render.chosen = [this](sim_povray::RendererKind kind, bool is_checked) {
      const std::lock_guard lock(renderer_mutex_);
      renderer_ = fmt::format("{}{}", to_string(kind), is_checked ? "" : " unchecked");
    };
    world.place.render.notice = [this](const std::string& notice) { record_.note_later(notice); };
    if (is_served) {  // only the server knows the scene
      record_.info().effects.push_back(
          fmt::format("those of the world '{}', which another program serves", world.attach));
      return {};
    }
    const auto table = sim_povray::effect_table(world.place, world.session, config::to_views(settings), places);
    if (!table) return table.error();
    for (const sim_povray::EffectRow& row : *table) {
      if (row.on) record_.info().effects.push_back(fmt::format("{}: {}", row.effect, row.reason));
    }
    start_check_.emplace(robot_, world.place, world.session.name, start_place);
    return {};
  }

  /// Opens the robot. Waits for a served world that may be starting.
  Result<Robot> open(const drivers::RobotSettings& settings) {
    const SteadyTime deadline = std::chrono::steady_clock::now() + kServingTimeout;
    bool is_reported = false;
    while (true) {
      auto opened = options_.open(settings);
      const bool is_missing =
          !opened && opened.error().code == ErrorCode::kNotFound && settings.world && !settings.world->attach.empty();
      if (!is_missing || std::chrono::steady_clock::now() >= deadline) return opened;
      if (stop_) return interrupted();
      if (!std::exchange(is_reported, true) && options_.notify) {
        options_.notify(fmt::format("waiting for the world '{}' to be served", settings.world->attach));
      }
      base::Logger("run").info("the world is not served yet; tried again");
      std::this_thread::sleep_for(kBetweenCalls);
    }
  }

  Status drive(Robot& robot, const drivers::RobotSettings& settings) {
    if (auto started = robot.start(settings.lower.settings, settings.upper.settings); !started) return started;
    record_.note_devices(robot);
    waits_for_program_ = robot.pace().waits_for_program;
    taker_.emplace(robot, robot_, begin_, clock_before_s_, options_.patience,
                   [this](const std::string& event) { record_.note(event); });
    for (int i = 0; i < options_.frames; ++i) {
      const auto number = std::uint64_t(i);
      // The first rendered images take longer: the mirrors are found, and the renderers compared. What a resumed run
      // has stored is not paced.
      if (options_.real_time && i > record_.replayed()) real_time_.wait(stop_);
      if (stop_) return interrupted();
      auto taken = taker_->take(number, stop_);
      if (!taken) return taken.error();
      const runlog::PoseRow& odometry = taken->record.odometry;
      steering_.add_odometry(number, {odometry.x_m, odometry.y_m, odometry.heading_rad});
      pending_.push_back(*std::move(taken));
      if (int(pending_.size() + answers_ahead_.size()) > robot_.latency_frames) {
        if (auto used = use_oldest(); !used) return used;
      }
      // A program whose work on a frame takes longer than the dead-man time must stand, not drive in jerks.
      const double worked_s = std::max(taker_->age_s(), std::chrono::duration<double>(answer_time_).count());
      const WheelSpeeds speeds = steering_.decide(number, taker_->step_s(), waits_for_program_ ? 0 : worked_s);
      if (auto commanded = taker_->command(number, speeds); !commanded) return commanded;
      if (auto answered = answer_ahead(); !answered) return answered;
      progress_(double(record_.frames()) / options_.frames);
    }
    // The robot stands still until the last images have arrived.
    if (auto stopped = robot.drive().stop(); !stopped) return stopped;
    while (!pending_.empty()) {
      if (auto answered = answer_oldest(); !answered) return answered;
      progress_(double(record_.frames()) / options_.frames);
    }
    return {};
  }

  /// The answer of a frame, until it is old enough to steer by.
  struct Answer {
    std::uint64_t frame;
    std::optional<Eigen::Vector2d> position_m;
    std::vector<Disc> found;         ///< landmarks found on the way
    std::optional<Pose2> estimate;   ///< where the robot steers by it: behaviour explore, estimator.plan
    std::vector<vision::Beam> scan;  ///< of a run that scans
  };

  /// Steers by the oldest answer that was not used, which is computed now unless that was done before.
  Status use_oldest() {
    if (answers_ahead_.empty()) {
      if (auto answered = answer_oldest(); !answered) return answered;
    }
    const Answer& answer = answers_ahead_.front();
    if (scanner_ || answer.estimate) {
      steering_.add_scan(answer.frame, answer.estimate, answer.scan);
    } else if (answer.position_m) {
      steering_.add_fix(answer.frame, *answer.position_m);
    }
    if (options_.maps) steering_.avoid(answer.found);
    answers_ahead_.pop_front();
    return {};
  }

  /// Answers the frames whose images are here, until the next frame is due: watchers see a frame early, and decisions
  /// use the same answers as without this. Does nothing where no time passes between frames: the next one is due at
  /// once.
  Status answer_ahead() {
    if (waits_for_program_ && !options_.real_time) return {};
    while (!pending_.empty()) {
      if (options_.real_time && !has_arrived(pending_.front(), real_time_.left() - answer_time_)) return {};
      if (auto answered = answer_oldest(); !answered) return answered;
    }
    return {};
  }

  /// Waits for the images of a frame. Returns false without a time to wait, and for images that cannot be had.
  static bool has_arrived(const TakenFrame& taken, RealTime::Milliseconds wait) {
    const SteadyTime end = std::chrono::steady_clock::now() + std::chrono::duration_cast<SteadyTime::duration>(wait);
    const auto is_here = [&](const Frame& frame) {
      const auto left = end - std::chrono::steady_clock::now();
      return left.count() > 0 && frame.image(std::chrono::ceil<std::chrono::milliseconds>(left)).has_value();
    };
    return is_here(taken.frame.lower) && is_here(taken.frame.upper) &&
           std::ranges::all_of(taken.others, is_here, &NamedFrame::frame);
  }

  /// Takes the oldest frame without an answer, waits for its images, computes its answer and writes both.
  Status answer_oldest() {
    TakenFrame taken = std::move(pending_.front());
    pending_.pop_front();
    runlog::FrameRecord& record = taken.record;
    const auto failed = [&](const Error& error) {
      return with_name(fmt::format("frame {}", record.frame.frame), error);
    };
    const SteadyTime waited_from = std::chrono::steady_clock::now();
    const IsStopped is_stopped = [this] { return stop_.load(); };
    const auto images = wait_for_images(taken.frame, is_stopped);
    if (!images) return failed(images.error());
    const auto& [lower, upper] = *images;
    std::vector<runlog::OtherImage> others;
    for (const NamedFrame& other : taken.others) {
      const auto image = wait_for_image(other.frame, is_stopped);
      if (!image) return failed(with_name(other.name, image.error()));
      others.push_back({other.name, *image});
    }
    record_.info().render_wait_s += seconds_since(waited_from);
    const SteadyTime begin = std::chrono::steady_clock::now();
    if (record_.frames() == 0) {
      if (auto checked = check_first(*lower, *upper); !checked) return checked;
    }
    const auto position_m = answers_.answer(*lower, *upper, record);
    if (!position_m) return failed(position_m.error());
    // The search takes as long as many frames, so that it is made once, where the rig may be the reason.
    if (record_.frames() == 0 && (!rim_warnings_.empty() || !*position_m)) {
      rig_warning_ = std::async(std::launch::async, [this, lower = *lower, upper = *upper] {
        return rig_warning(robot_, map_, lower, upper);
      });
    }
    tell_of_rig(waits_for_program_ ? kWait : kIfReady);
    FinishedFrame finished{{}, lower, upper, std::move(others), {}};
    if (options_.truth) finished.truth = truth_of(taken);
    Answer answer{record.frame.frame, *position_m, discs_of(answers_.found()), {}, {}};
    if (scanner_ && record.scan.empty()) record.scan = scanner_->scan(*lower, *upper);
    answer.scan = record.scan;
    // Without landmarks there is no fix by which to steer, but the track has a pose by the floor plan.
    if (scanner_ || !record.answer.track->plan.empty()) {
      if (const auto pose = runlog::pose_of(*record.answer.track)) {
        answer.estimate = Pose2{pose->x_m, pose->y_m, pose->heading_rad};
      }
    }
    answers_ahead_.push_back(std::move(answer));
    const double arrived_s = record.frame.host_t_s.value_or(0) - clock_before_s_;
    finished.record = std::move(record);
    if (options_.finished) {
      options_.finished(finished,
                        {.age_s = seconds_since(begin_) - arrived_s,
                         .late_frames = options_.real_time ? std::optional(real_time_.late()) : std::nullopt});
    }
    record_.add(std::move(finished));
    answer_time_ = std::chrono::steady_clock::now() - begin;
    return {};
  }

  enum WhenTold { kWait, kIfReady };

  /// Reports what the search for the rig found. Real devices go on meanwhile: waiting would hold up the wheels.
  void tell_of_rig(WhenTold when) {
    if (!rig_warning_.valid()) return;
    if (when == kIfReady && rig_warning_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    // It holds the numbers of all that is wrong, and so of the rims.
    if (const auto found = rig_warning_.get()) rim_warnings_ = {*found};
    for (const std::string& warning : rim_warnings_) record_.note(warning);
  }

  /// Returns what the frame's images show, except for those that a resumed run has stored.
  std::vector<runlog::CameraTruth> truth_of(const TakenFrame& taken) {
    std::vector<runlog::CameraTruth> result;
    const auto add = [&](const std::string& camera, const Frame& frame) {
      auto truth = truth_.take(camera, frame.header().sequence);
      if (truth) result.push_back({camera, *std::move(truth)});
    };
    add("lower", taken.frame.lower);
    add("upper", taken.frame.upper);
    for (const NamedFrame& other : taken.others) add(other.name, other.frame);
    if (!result.empty() && !std::exchange(has_true_objects_, true)) {
      runlog::write_true_objects(record_.path(), *result.front().pixels.objects, map_.landmarks);
    }
    return result;
  }

  /// Checks the start and the mirrors' rims in the first images.
  Status check_first(const Image& lower, const Image& upper) {
    if (start_check_) {
      const auto checked = start_check_->wait(stop_);
      if (!checked) return checked.error();
      if (*checked) record_.note(**checked);
    }
    for (const std::string& line : rim_warnings(robot_, lower, upper)) {
      if (line.starts_with("warning")) {
        rim_warnings_.push_back(line);
      } else {
        record_.note(line);
      }
    }
    note_renderer();
    if (!record_.info().renderer.empty()) record_.write_yaml();  // resume() reads it
    return {};
  }

  void note_renderer() {
    const std::lock_guard lock(renderer_mutex_);
    // A resumed run may end before any image had to be rendered.
    if (!renderer_.empty()) record_.info().renderer = renderer_;
  }

  void note_capture(const Robot& robot) {
    auto& capture = record_.info().capture;
    if (!capture) return;
    capture->unpaired = robot.cameras().unpaired();
    capture->recoveries = robot.cameras().recoveries();
    capture->lower_skipped = taker_->lower_skipped();
    capture->upper_skipped = taker_->upper_skipped();
  }

  Result<runlog::RunInfo> end(const Status& done) {
    record_.finish_frames();
    tell_of_rig(kWait);
    note_renderer();
    runlog::RunInfo& info = record_.info();
    std::vector<std::string> last = record_.take_later();
    if (auto event = answers_.over_budget()) last.push_back(*event);
    if (auto event = real_time_.report(); !event.empty()) last.push_back(std::move(event));
    if (!done) {
      // After an interruption, the message states the number of frames.
      const Error error = done.error().code == ErrorCode::kCancelled ? interrupted() : done.error();
      // The caller reports the error that ended the run, so it is not sent to RunOptions::notify.
      last.push_back(error.message);
      info.events.insert(info.events.end(), last.begin(), last.end());
      if (record_.frames() > 0) base::Logger("run").error(error.message);
      record_.write_yaml();
      return error;
    }
    for (const std::string& event : last) record_.note(event);
    info.wall_s = seconds_since(begin_);
    info.own_cpu_s = cpu_seconds(RUSAGE_SELF);
    info.render_cpu_s = cpu_seconds(RUSAGE_CHILDREN);
    record_.finish(answers_.baseline());
    return info;
  }

  [[nodiscard]] Error interrupted() const {
    return Error(ErrorCode::kCancelled, "stopped from outside after {} frames", record_.frames());
  }

  const config::Robot& robot_;
  const config::Map& map_;
  const RunOptions& options_;
  const Progress& progress_;
  const std::atomic<bool>& stop_;
  const SteadyTime begin_ = std::chrono::steady_clock::now();
  std::mutex renderer_mutex_;
  std::string renderer_;  // RunInfo::renderer, from a thread of the renderer
  RunRecord record_;
  Steering steering_;
  FrameAnswers answers_;
  std::optional<estimation::Scanner> scanner_;
  std::optional<StartCheck> start_check_;
  RealTime real_time_{RealTime::Milliseconds(1e3 / robot_.lower.settings.rate_hz)};
  TruthCollector truth_;
  bool has_true_objects_ = false;
  std::vector<std::string> rim_warnings_;  ///< the first images show a rim elsewhere, or none
  std::future<std::optional<std::string>> rig_warning_;
  bool waits_for_program_ = false;  ///< the time of the devices stands still between frames
  std::optional<FrameTaker> taker_;
  std::deque<TakenFrame> pending_;         ///< without an answer
  std::deque<Answer> answers_ahead_;       ///< of the frames before those
  RealTime::Milliseconds answer_time_{0};  ///< that the last answer took
  double clock_before_s_ = 0;              ///< host_t_s of the last stored frame of a resumed run
};

}  // namespace

Result<runlog::RunInfo> run(const config::Robot& robot, const config::Map& map, const RunOptions& options,
                            const Progress& progress, const std::atomic<bool>& stop) {
  if (options.frames < 1) throw base::InvalidArgument("frames is {}, must be >= 1", options.frames);
  return Loop(robot, map, options, progress, stop).go();
}

}  // namespace twocone::runs
