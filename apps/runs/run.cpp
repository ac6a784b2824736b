// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <future>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "apps/behaviours/behaviour.h"
#include "apps/files/file_error.h"
#include "apps/files/key_places.h"
#include "apps/files/to_layers.h"
#include "apps/runs/believed_pose.h"
#include "apps/runs/devices.h"
#include "apps/runs/effort.h"
#include "apps/runs/notices.h"
#include "apps/runs/outage.h"
#include "apps/runs/replace_run.h"
#include "apps/runs/rim_warnings.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/run_yaml.h"
#include "apps/runs/scene_files.h"
#include "apps/runs/start_check.h"
#include "apps/runs/stored_images.h"
#include "apps/runs/summary.h"
#include "apps/runs/track.h"
#include "apps/runs/truth_table.h"
#include "apps/runs/version.h"
#include "apps/runs/wheel_history.h"
#include "drivers/backends.h"
#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/reflected_truth.h"

namespace twocone::runs {
namespace {

using std::chrono::milliseconds;
using SteadyTime = std::chrono::steady_clock::time_point;

// Many frame periods of any camera. A simulation answers at once, as its pictures come later; but a served world waits
// for the slowest of its robots, which may be looking at a picture.
constexpr milliseconds kFrameTimeout{5'000};
constexpr milliseconds kServedFrameTimeout{60'000};
// Devices: so many periods without a pair, and so long, and the wheels are stopped.
constexpr double kSilentPeriods = 4;
constexpr milliseconds kLeastSilence{1'000};
constexpr milliseconds kBetweenTries{10};
// A world that is starting can be reached well within a second; a loaded machine takes longer.
constexpr milliseconds kServingTimeout{5'000};
constexpr milliseconds kBetweenCalls{100};
// How often a wait for a picture looks whether it is to stop.
constexpr milliseconds kStopSlice{100};
// Longer than the renderer's own limit for one picture, so that its message is the one that is told.
constexpr milliseconds kPictureTimeout{150'000};

double seconds_since(SteadyTime begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double cpu_seconds(int who) {
  rusage usage{};
  ::getrusage(who, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::unique_ptr<behaviours::Behaviour> make_behaviour(const files::Robot& robot, const files::Map& map,
                                                      const RunOptions& options) {
  const behaviours::Body body{robot.body_radius_m, robot.drive.max_speed_mps, robot.drive.wheel_separation_m};
  if (options.behaviour == "still") return std::make_unique<behaviours::Still>();
  if (options.behaviour == "wander") {
    return std::make_unique<behaviours::Wander>(body, files::to_arena(map), options.seed);
  }
  if (options.behaviour == "waypoints") {
    std::vector<Eigen::Vector2d> points_m;
    for (const files::Point& p : robot.waypoints) points_m.emplace_back(p.x_m, p.y_m);
    if (points_m.empty()) {
      throw files::FileError(fmt::format("{}: behaviour waypoints needs the key waypoints_m: [[x, y], ...] in metres",
                                         robot.file.string()));
    }
    return std::make_unique<behaviours::Waypoints>(body, points_m);
  }
  throw std::invalid_argument(fmt::format("no behaviour '{}'; there are: wander, waypoints, still", options.behaviour));
}

/// A frame that has been stepped, but whose pictures have not been looked at.
struct Pending {
  StereoFrame frame;
  FrameRecord record;
  std::vector<NamedFrame> others;
};

class Loop {
 public:
  Loop(const files::Robot& robot, const files::Map& map, const RunOptions& options)
      : robot_(robot),
        map_(map),
        options_(options),
        begin_(std::chrono::steady_clock::now()),
        behaviour_(make_behaviour(robot, map, options)),
        estimator_(options.method, robot, map),
        track_(options.method, robot),
        odometry_(files::to_wheels(robot), files::to_start_pose(robot)),
        is_simulated_(files::is_simulated(robot)),
        outage_(is_simulated_ ? milliseconds(0) : options.patience, [this](const std::string& event) { note(event); }) {
    info_.version = version();
    info_.commit = commit();
    info_.compiler = compiler();
    info_.behaviour = options.behaviour;
    info_.method = to_string(options.method);
    info_.seed = options.seed;
    info_.frames_wanted = options.frames;
    info_.truth = options.truth;
    if (options.method == Method::kPaper) return;
    try {
      baseline_.emplace(Baseline{Estimator(Method::kPaper, robot, map), Track(Method::kPaper, robot), {}});
    } catch (const files::FileError& error) {
      note(fmt::format("no baseline: {}", error.what()));
    }
  }

  Result<RunInfo> go(const Progress& progress, const std::atomic<bool>& stop) {
    if (options_.replace) check_replaceable(options_.out);  // better said now than after a start
    stop_ = &stop;
    drivers::RobotSettings settings = files::to_robot_settings(robot_, map_, options_.seed);
    if (settings.world) {
      if (map_.scene && robot_.attach.empty()) info_.scene_files = scene_files(map_);
      if (options_.old == OldLines::kKeep) replay_stored(*settings.world);
      start_place_ = place_of_start();
      settings.world->seat.body.start_place = start_place_;
      settings.world->place.render.notice = [this](const std::string& notice) { notices_.add(notice); };
      if (auto listed = list_effects(settings); !listed) return listed.error();
    }
    if (options_.truth) {
      if (auto prepared = prepare_truth(settings); !prepared) return prepared.error();
    }
    begin_start_check(settings);
    auto opened = open(settings);
    if (!opened) return opened.error();
    if (options_.replace) remove_run(options_.out);
    folder_.emplace(options_.out, options_.old);
    write_run_yaml(folder_->path(), info_, robot_, map_.file);
    if (is_simulated_ && options_.tell) {
      options_.tell(fmt::format("{} frames; POV-Ray takes some seconds for the first", options_.frames));
    }

    Status done;
    {
      Robot robot = std::move(*opened);
      done = drive(robot, settings, progress, stop);
      robot.stop();
      if (info_.capture) {
        info_.capture->unpaired = robot.cameras().unpaired();
        info_.capture->recoveries = robot.cameras().recoveries();
      }
    }  // Its simulation ends with it, and so do the programs which that has started: their time is known from here on.
    if (!done) {
      for (const std::string& notice : notices_.take()) info_.events.push_back(notice);  // what ended it is told alone
      if (auto event = over_budget()) info_.events.push_back(*event);
      info_.events.push_back(done.error().message);  // the caller tells it
      write_run_yaml(folder_->path(), info_, robot_, map_.file);
      return done.error();
    }
    for (const std::string& notice : notices_.take()) note(notice);
    if (auto event = over_budget()) note(*event);
    info_.finished = true;
    info_.wall_s = seconds_since(begin_);
    info_.own_cpu_s = cpu_seconds(RUSAGE_SELF);
    info_.render_cpu_s = cpu_seconds(RUSAGE_CHILDREN);
    if (baseline_) {
      const std::string paper(to_string(Method::kPaper));
      write_results(folder_->path(), paper, baseline_->answers, OnTop::kNo, summary_of(paper));
    }
    file_results(folder_->path(), info_.method, summary_of(info_.method));
    write_run_yaml(folder_->path(), info_, robot_, map_.file);  // last: a run that says so has all its results
    return info_;
  }

 private:
  Status drive(Robot& robot, const drivers::RobotSettings& settings, const Progress& progress,
               const std::atomic<bool>& stop) {
    if (auto started = robot.start(settings.lower.settings, settings.upper.settings); !started) return started;
    note_devices(robot);
    for (int i = 0; i < options_.frames; ++i) {
      if (stop) return stopped_from_outside();
      if (auto stepped = step(robot, std::uint64_t(i), stop); !stepped) return stepped;
      if (int(pending_.size()) > robot_.latency_frames) {
        if (auto looked = look(); !looked) return looked;
      }
      if (auto steered = steer(robot, std::uint64_t(i)); !steered) return steered;
      progress(double(finished_) / options_.frames);
    }
    // The wheels rest while the last pictures come.
    if (auto stopped = robot.drive().stop(); !stopped) return stopped;
    while (!pending_.empty()) {
      if (auto looked = look(); !looked) return looked;
      progress(double(finished_) / options_.frames);
    }
    return {};
  }

  void note(const std::string& event) {
    info_.events.push_back(event);
    if (options_.tell && finished_ >= replayed_) options_.tell(event);  // what is replayed was told before
  }

  [[nodiscard]] SummaryOf summary_of(const std::string& method) const {
    return [this, method](const std::filesystem::path& results) {
      return to_json(summarise(read_run_with(folder_->path(), results, method)), info_);
    };
  }

  /// The world is driven again from its start, and the cameras hand out what they took then.
  void replay_stored(drivers::SimulatedWorld& world) {
    const StoredImages stored(options_.out);
    replayed_ = stored.frames();
    clock_before_s_ = stored.last_host_t_s();
    world.seat.stored = stored;
    info_.events.push_back(fmt::format("gone on with after {} frames that were there", replayed_));
  }

  /// What a real robot is made of, in run.yaml from the first frame on.
  void note_devices(Robot& robot) {
    if (is_simulated_) return;
    info_.devices = {describe("lower", robot.cameras().lower().facts()),
                     describe("upper", robot.cameras().upper().facts()), describe(robot.drive().facts())};
    std::erase(info_.devices, "");
    info_.capture.emplace();
    write_run_yaml(folder_->path(), info_, robot_, map_.file);
  }

  /// Where the robot file says `start`; the file alone where it cannot be read again.
  [[nodiscard]] std::string place_of_start() const {
    try {
      const auto places = files::key_places(robot_, map_);
      const auto found = places.find("start");
      if (found != places.end()) return found->second;
    } catch (const files::FileError&) {  // a robot that was put together by a program
    }
    return robot_.file.string();
  }

  /// Asks POV-Ray where the scene shows the robot, while the first pictures are rendered.
  void begin_start_check(const drivers::RobotSettings& settings) {
    if (!settings.world || !settings.world->attach.empty()) return;  // of a served world the scene is not known here
    std::promise<Result<sim_povray::ShownCamera>> answer;
    shown_ = answer.get_future();
    asker_ = std::jthread([place = settings.world->place, name = settings.world->seat.name,
                           answer = std::move(answer)](const std::stop_token& stop) mutable {
      try {
        answer.set_value(sim_povray::shown_camera(place, name, "lower", stop));
      } catch (const std::exception& error) {  // no descriptor, no memory
        answer.set_value(Error{ErrorCode::kUnavailable, error.what()});
      }
    });
  }

  /// Before the first answer.
  Status check_start() {
    if (!shown_.valid()) return {};
    while (shown_.wait_for(kStopSlice) != std::future_status::ready) {
      if (*stop_) return stopped_from_outside();
    }
    const auto shown = shown_.get();
    if (!shown) {
      note(fmt::format("{}: start could not be compared with where the scene shows the robot: {}", start_place_,
                       shown.error().message));
      return {};
    }
    const auto compared = compare_start(robot_, *shown, start_place_);
    if (!compared) return compared.error();
    if (*compared) note(**compared);
    return {};
  }

  /// A world that another program serves may be starting.
  Result<Robot> open(const drivers::RobotSettings& settings) {
    const SteadyTime deadline = std::chrono::steady_clock::now() + kServingTimeout;
    bool is_told = false;
    while (true) {
      auto opened = options_.open(settings);
      const bool is_missing =
          !opened && opened.error().code == ErrorCode::kNotFound && settings.world && !settings.world->attach.empty();
      if (!is_missing || std::chrono::steady_clock::now() >= deadline) return opened;
      if (*stop_) return stopped_from_outside();
      if (!std::exchange(is_told, true) && options_.tell) {
        options_.tell(fmt::format("waiting for the world '{}' to be served", settings.world->attach));
      }
      std::this_thread::sleep_for(kBetweenCalls);
    }
  }

  /// The picture, once it is there. A stop from outside is heard meanwhile: the first pictures of a scene may take
  /// minutes.
  ImageResult picture_of(const Frame& frame) {
    const SteadyTime deadline = std::chrono::steady_clock::now() + kPictureTimeout;
    while (true) {
      const SteadyTime begin = std::chrono::steady_clock::now();
      auto image = frame.image(kStopSlice);
      const SteadyTime now = std::chrono::steady_clock::now();
      // A time-out that comes at once is the renderer's, not this wait's.
      const bool is_pending = !image && image.error().code == ErrorCode::kTimeout && now - begin >= kStopSlice / 2;
      if (!is_pending || now >= deadline) return image;
      if (*stop_) return stopped_from_outside();
    }
  }

  /// A pair and what the wheels had turned by then.
  struct Taken {
    StereoFrame frame;
    WheelAngles angles;
    SteadyTime at;  ///< when the frame had come
  };

  Result<Taken> try_take(Robot& robot) {
    auto frame = robot.next_frame(frame_timeout());
    if (!frame) return frame.error();
    const SteadyTime at = std::chrono::steady_clock::now();
    const auto angles = robot.drive().read_angles();
    if (!angles) return Error{angles.error().code, fmt::format("drive: {}", angles.error().message)};
    // The pixels of devices are there. Decoding them now tells damaged ones while there still is another frame to take,
    // and gives lent ones back.
    if (!is_simulated_) {
      for (Frame* view : {&frame->lower, &frame->upper}) {
        if (auto decoded = decode(*view); !decoded) {
          return with_name(view == &frame->lower ? "lower" : "upper", decoded.error());
        }
      }
    }
    return Taken{std::move(*frame), *angles, at};
  }

  /// The next pair. Devices that fail are asked again, the wheels at rest, until it is too long.
  Result<Taken> take(Robot& robot, std::uint64_t number, const std::atomic<bool>& stop) {
    while (true) {
      auto taken = try_take(robot);
      if (taken) return taken;
      if (auto bearable = outage_.failed(number, taken.error()); !bearable) return bearable.error();
      if (stop) return stopped_from_outside();
      if (taken.error().code != ErrorCode::kBadData) rest(robot);
      std::this_thread::sleep_for(kBetweenTries);
    }
  }

  void rest(Robot& robot) {
    command_ = {};
    has_rested_ = true;
    // If it cannot be told, the dead-man rule stops the wheels.
    static_cast<void>(robot.drive().stop());
  }

  [[nodiscard]] milliseconds frame_timeout() const {
    if (is_simulated_) return robot_.attach.empty() ? kFrameTimeout : kServedFrameTimeout;
    return std::max(kLeastSilence, milliseconds(std::llround(1000 * kSilentPeriods / robot_.lower.rate_hz)));
  }

  [[nodiscard]] Error stopped_from_outside() const {
    return {ErrorCode::kRefused, fmt::format("stopped from outside after {} frames", finished_)};
  }

  Status step(Robot& robot, std::uint64_t number, const std::atomic<bool>& stop) {
    auto taken = take(robot, number, stop);
    if (!taken) return taken.error();
    StereoFrame* const frame = &taken->frame;
    taken_at_ = taken->at;
    wheels_.add(taken->angles);
    const WheelAngles angles = wheels_.at(frame->lower.header().captured);
    const localisation::Pose& pose = odometry_.update(angles.left_rad, angles.right_rad);
    belief_.add_odometry(number, pose);

    const Frame::Header& lower = frame->lower.header();
    const Frame::Header& upper = frame->upper.header();
    if (number == 0) zero_s_ = lower.captured.seconds();
    const double lower_t_s = lower.captured.seconds() - zero_s_;
    const double upper_t_s = upper.captured.seconds() - zero_s_;
    const double t_s = lower_t_s;
    FrameRecord record;
    record.frame = {number,
                    t_s,
                    std::chrono::duration<double>(frame->skew()).count(),
                    lower_t_s,
                    upper_t_s,
                    lower.sequence,
                    upper.sequence,
                    lower.lost_before,
                    upper.lost_before,
                    clock_before_s_ + seconds_since(begin_)};
    record.drive = {t_s, command_.left_radps, command_.right_radps, angles.left_rad, angles.right_rad};
    note_contact(number, robot.contact());
    if (const auto truth = robot.true_pose()) record.truth = PoseRow{t_s, truth->x_m, truth->y_m, truth->heading_rad};
    record.odometry = {t_s, pose.x_m, pose.y_m, pose.heading_rad};
    // What the robot did not drive is no step.
    const bool is_first = number == 0 || std::exchange(has_rested_, false);
    step_s_ = is_first ? 1 / robot_.lower.rate_hz : t_s - last_t_s_;
    if (info_.capture) {
      info_.capture->lower_skipped += lower.skipped_before;
      info_.capture->upper_skipped += upper.skipped_before;
    }
    last_t_s_ = t_s;
    pending_.push_back({std::move(*frame), std::move(record), robot.other_frames()});
    return {};
  }

  void note_contact(std::uint64_t number, const std::string& contact) {
    if (contact != contact_ && !contact.empty()) {
      note(fmt::format("collision: at frame {} the robot touches {}", number, contact));
    }
    contact_ = contact;
  }

  /// What the simulation does, and why. Of a served world it is the server that knows.
  Status list_effects(const drivers::RobotSettings& settings) {
    if (!settings.world->attach.empty()) {
      info_.effects.push_back(fmt::format("those of the world '{}', which another program serves", robot_.attach));
      return {};
    }
    const auto table = sim_povray::effect_table(settings.world->place, settings.world->seat, files::to_views(settings),
                                                files::key_places(robot_, map_));
    if (!table) return table.error();
    for (const sim_povray::EffectRow& row : *table) {
      if (row.on) info_.effects.push_back(fmt::format("{}: {}", row.effect, row.reason));
    }
    return {};
  }

  Status prepare_truth(const drivers::RobotSettings& settings) {
    if (!settings.world || !settings.world->attach.empty()) {
      return Error{
          ErrorCode::kRefused,
          fmt::format("{}: --truth needs a simulated world inside this program: only that knows where everything "
                      "is",
                      robot_.file.string())};
    }
    auto object = sim_povray::claimed_object(settings.world->place, settings.world->seat.name);
    if (!object) return object.error();
    truth_ = Truth{settings.world->place, *object, object->substr(std::string("robot").size()), {}};
    for (const files::Landmark& l : map_.landmarks) {
      truth_->landmarks.push_back({l.name, l.x_m, l.y_m, l.radius_m, l.top_m});
    }
    return {};
  }

  /// What each mirror really shows, beside the pictures.
  Status write_truths(const FrameRecord& record, const StereoFrame& frame) {
    const PoseRow& now = *record.truth;
    const auto start = files::to_start_pose(robot_);
    const sim_povray::Stance robot{
        truth_->object, {start.x_m, start.y_m, start.heading_rad}, {now.x_m, now.y_m, now.heading_rad}};
    const auto others = sim_povray::moving_stances(truth_->place, frame.lower.header().captured.since_zero);
    for (const auto& [view, camera] : {std::pair{"lower", &robot_.lower}, {"upper", &robot_.upper}}) {
      const auto pixels = sim_povray::reflected_truth(truth_->place, robot,
                                                      {view + truth_->ending, camera->width_px, camera->height_px},
                                                      truth_->landmarks, others);
      if (!pixels) return pixels.error();
      write_truth(truth_file(folder_->path(), view, record.frame.frame), *pixels, truth_->landmarks);
    }
    return {};
  }

  /// Takes the oldest frame that nobody has looked at: waits for its pictures, ranges, fixes, writes.
  Status look() {
    Pending pending = std::move(pending_.front());
    pending_.pop_front();
    FrameRecord& record = pending.record;
    const auto failed = [&record](const Error& error) {
      return Error{error.code, fmt::format("frame {}: {}", record.frame.frame, error.message)};
    };
    const auto waited_from = std::chrono::steady_clock::now();
    const auto lower = picture_of(pending.frame.lower);
    if (!lower) return failed(lower.error());
    const auto upper = picture_of(pending.frame.upper);
    if (!upper) return failed(upper.error());
    std::vector<OtherPicture> others;
    for (const NamedFrame& other : pending.others) {
      const auto image = picture_of(other.frame);
      if (!image) return failed(with_name(other.name, image.error()));
      others.push_back({other.name, *image});
    }
    info_.render_wait_s += seconds_since(waited_from);
    if (finished_ == 0) {
      if (auto checked = check_start(); !checked) return checked;
      for (const std::string& warning : rim_warnings(robot_, **lower, **upper)) note(warning);
    }

    const auto answer = estimator_.answer(**lower, **upper);
    if (!answer) return failed(answer.error());
    record.answer = rows_of(record, *answer, track_);
    record.answer.effort = effort_of(record, *answer, options_.method);
    effort_.push_back(*record.answer.effort);
    if (baseline_) {
      const auto baseline = baseline_->estimator.answer(**lower, **upper);
      if (!baseline) return failed(baseline.error());
      baseline_->answers.push_back(rows_of(record, *baseline, baseline_->track));
      baseline_->answers.back().effort = effort_of(record, *baseline, Method::kPaper);
    }
    if (truth_) {
      if (auto told = write_truths(record, pending.frame); !told) return failed(told.error());
    }
    folder_->add(record, **lower, **upper, others);
    if (is_place(answer->fix)) belief_.add_fix(record.frame.frame, *answer->fix.position_m);
    ++finished_;
    return {};
  }

  [[nodiscard]] AnswerRows rows_of(const FrameRecord& record, const FrameAnswer& answer, Track& track) const {
    AnswerRows rows =
        to_rows(record.frame.frame, record.frame.t_s, answer, map_, record.truth ? &*record.truth : nullptr);
    rows.track = track.follow(record.frame.frame, record.drive, record.odometry, answer.fix);
    return rows;
  }

  [[nodiscard]] EffortRow effort_of(const FrameRecord& record, const FrameAnswer& answer, Method method) const {
    return to_row(record.frame.frame, record.frame.t_s, answer.effort, budget_of(method, robot_).has_value());
  }

  [[nodiscard]] std::optional<std::string> over_budget() const {
    const auto budget_s = budget_of(options_.method, robot_);
    return budget_s ? budget_event(effort_, *budget_s) : std::nullopt;
  }

  /// The dead-man rule for what the robot sees: a picture older than command_timeout_s moves no wheel. So a camera that
  /// is gone stops them in that time, too, however long its last picture was looked at.
  bool is_late(std::uint64_t number) {
    if (is_simulated_) return false;
    const double age_s = seconds_since(taken_at_);
    if (age_s <= robot_.drive.command_timeout_s) return false;
    if (!std::exchange(was_late_, true)) {
      note(
          fmt::format("frame {}: it was looked at for {:.2f} s, longer than command_timeout_s of {} s: the wheels rest "
                      "for this and any other such frame",
                      number, age_s, robot_.drive.command_timeout_s));
    }
    return true;
  }

  Status steer(Robot& robot, std::uint64_t number) {
    const behaviours::Motion motion =
        is_late(number) ? behaviours::Motion{} : behaviour_->decide(belief_.pose(), step_s_);
    const double half_m = robot_.drive.wheel_separation_m / 2;
    const auto applied =
        robot.drive().set_speeds({(motion.speed_mps - motion.turn_rate_radps * half_m) / robot_.drive.wheel_radius_m,
                                  (motion.speed_mps + motion.turn_rate_radps * half_m) / robot_.drive.wheel_radius_m});
    if (!applied) {
      command_ = {};
      return outage_.failed(number, {applied.error().code, fmt::format("drive: {}", applied.error().message)});
    }
    command_ = *applied;
    outage_.over(number);
    return {};
  }

  const files::Robot& robot_;
  const files::Map& map_;
  const RunOptions& options_;
  const SteadyTime begin_;
  std::unique_ptr<behaviours::Behaviour> behaviour_;
  Estimator estimator_;
  Track track_;
  /// Method paper beside another one.
  struct Baseline {
    Estimator estimator;
    Track track;
    std::vector<AnswerRows> answers;
  };
  std::optional<Baseline> baseline_;
  std::vector<EffortRow> effort_;
  localisation::Odometry odometry_;
  BelievedPose belief_;
  std::optional<RunFolder> folder_;
  std::deque<Pending> pending_;
  RunInfo info_;
  Notices notices_;
  std::string contact_;
  /// What --truth renders.
  struct Truth {
    sim_povray::PlaceSettings place;
    std::string object;
    std::string ending;  ///< of its cameras' names
    std::vector<sim_povray::TrueLandmark> landmarks;
  };
  std::optional<Truth> truth_;
  WheelHistory wheels_;
  WheelSpeeds command_;
  SteadyTime taken_at_;
  double zero_s_ = 0;
  double last_t_s_ = 0;
  double step_s_ = 0;
  int finished_ = 0;
  int replayed_ = 0;           ///< frames of a run that is gone on with
  double clock_before_s_ = 0;  ///< when the last of them came, since that run began
  bool has_rested_ = false;
  bool was_late_ = false;
  const bool is_simulated_;
  const std::atomic<bool>* stop_ = nullptr;
  std::string start_place_;
  std::future<Result<sim_povray::ShownCamera>> shown_;
  std::jthread asker_;
  Outage outage_;
};

}  // namespace

Result<RunInfo> run(const files::Robot& robot, const files::Map& map, const RunOptions& options,
                    const Progress& progress, const std::atomic<bool>& stop) {
  if (options.frames < 1) throw std::invalid_argument(fmt::format("frames is {}, must be >= 1", options.frames));
  return Loop(robot, map, options).go(progress, stop);
}

}  // namespace twocone::runs
