// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/povray_pool.h"

#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/signalfd.h>
#include <sys/statvfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "base/unique_fd.h"

namespace twocone::sim_povray {
namespace {

/// The number of times that an image which was lost with its process is started again.
constexpr int kMaxRetries = 2;
/// The same number for a process that read an old pose, on a machine so busy that a lease was not taken in time. The
/// image is not the cause of that.
constexpr int kMaxStale = 50;
/// Pause between two attempts to take a lease. POV-Ray sleeps a hundred times as long.
constexpr auto kRetakeAfter = std::chrono::milliseconds(2);

base::UniqueFd lease_signals() {
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGIO);
  base::UniqueFd fd(::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK));
  if (!fd.valid()) base::throw_errno("signalfd");
  return fd;
}

base::UniqueFd folder_events() {
  base::UniqueFd fd(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  if (!fd.valid()) base::throw_errno("inotify");
  return fd;
}

/// Reads at most `max` bytes and one more, which shows that the file is too long.
std::string read_at_most(const std::filesystem::path& path, std::size_t max) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(max + 1, '\0');
  file.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(std::size_t(file.gcount()));
  return bytes;
}

bool has_no_room(const std::filesystem::path& folder, std::size_t bytes) {
  struct statvfs room {};
  return ::statvfs(folder.c_str(), &room) == 0 && std::uint64_t(room.f_bavail) * room.f_frsize < bytes;
}

/// Returns whether POV-Ray stopped because it could not write. The scene is not the cause of that. On a full disk it
/// reports the last two.
bool is_write_error(const std::string& errors) {
  constexpr std::array kWords{"File I/O error", "render state output file", "Cannot open output file",
                              "Cannot access data in file", "Frontend halted render"};
  return std::ranges::any_of(kWords, [&](const char* words) { return errors.find(words) != std::string::npos; });
}

Order take_next(std::deque<Order>& queue) {
  Order order = std::move(queue.front());
  queue.pop_front();
  return order;
}

}  // namespace

PovrayPool::PovrayPool(const Povray& povray, const PoolSettings& settings)
    : povray_(povray),
      settings_(settings),
      idle_(std::min<std::chrono::nanoseconds>(settings.idle, std::chrono::milliseconds(500) * lease_break_time_s())),
      scratch_(settings.scratch_roots),
      signals_(lease_signals()),
      files_(folder_events()) {}

PovrayPool::~PovrayPool() {
  for (Order& order : give_back()) order.done(closed_error(order.job.label, "finished"));
}

std::vector<Order> PovrayPool::give_back() {
  std::vector<Order> orders;
  for (const auto& group : groups_) {
    for (Worker& worker : group->workers) {
      worker.povray->child().kill_group();
      if (auto order = worker.povray->take_order()) orders.push_back(std::move(*order));
    }
    std::move(group->queue.begin(), group->queue.end(), std::back_inserter(orders));
  }
  groups_.clear();
  std::sort(orders.begin(), orders.end(), [](const Order& a, const Order& b) { return a.number < b.number; });
  return orders;
}

std::size_t PovrayPool::share() const {
  return std::max<std::size_t>(1, std::size_t(settings_.processes) / std::max<std::size_t>(1, groups_.size()));
}

std::size_t PovrayPool::count() const {
  std::size_t sum = 0;
  for (const auto& group : groups_) sum += group->workers.size();
  return sum;
}

void PovrayPool::add(Order order) {
  auto found = std::find_if(groups_.begin(), groups_.end(),
                            [&](const auto& group) { return group->view_template == order.job.view_template; });
  if (found == groups_.end()) {
    try {
      groups_.push_back(
          std::make_unique<Group>(Group{order.job.view_template, HeldScene(*order.job.view_template), {}, {}, 0}));
    } catch (const std::system_error& e) {
      order.done(Error(ErrorCode::kUnavailable, "{}: no memory for the scene: {}", order.job.label, e.what()));
      return;
    }
    found = std::prev(groups_.end());
  }
  Group& group = **found;
  group.queue.push_back(std::move(order));
  const auto waiting = std::count_if(group.workers.begin(), group.workers.end(),
                                     [](const Worker& w) { return w.povray->state() == State::kWaiting; });
  if (group.queue.size() > std::size_t(waiting)) ++group.wanted;
}

// ---- giving work

void PovrayPool::hand_out() {
  for (const auto& group : groups_) {
    for (Worker& worker : group->workers) {
      if (group->queue.empty()) break;
      if (worker.povray->state() != State::kWaiting) continue;
      try {
        worker.povray->draw(take_next(group->queue));
      } catch (const std::system_error& e) {
        obstacle_ = e.what();
        return;
      }
    }
  }
}

void PovrayPool::staff() {
  for (const auto& group : groups_) {
    group->wanted = std::clamp<std::size_t>(group->wanted, group->queue.empty() ? 0 : 1, share());
    while (obstacle_.empty() && group->workers.size() < group->wanted) {
      if (count() >= std::size_t(settings_.processes) && !free_a_place(*group)) break;
      start_worker(*group);
    }
  }
}

void PovrayPool::start_worker(Group& group) {
  try {
    const auto folder = scratch_.path() / fmt::format("{}", ++started_);
    Worker worker{std::make_unique<HeldPovray>(povray_, *group.view_template, group.scene, folder)};
    worker.watch = ::inotify_add_watch(files_.get(), folder.c_str(), IN_CLOSE_WRITE);
    if (worker.watch < 0) base::throw_errno("inotify");
    group.workers.push_back(std::move(worker));
  } catch (const std::system_error& e) {
    // If the program causes this, one process per image fails too and reports it.
    obstacle_ = e.what();
  }
}

/// Ends an idle process of a view template that has more than its share or nothing to do, or whose work was ordered
/// later.
bool PovrayPool::free_a_place(const Group& taker) {
  Group* from = nullptr;
  std::size_t which = 0;
  SteadyTime oldest = SteadyTime::max();
  for (const auto& group : groups_) {
    if (group.get() == &taker) continue;
    const bool above = group->workers.size() > share();
    const bool later = taker.workers.empty() && !taker.queue.empty() &&
                       (group->queue.empty() || group->queue.front().number > taker.queue.front().number);
    if (!above && !later) continue;
    for (std::size_t i = 0; i < group->workers.size(); ++i) {
      const HeldPovray& povray = *group->workers[i].povray;
      if (povray.state() == State::kDrawing || povray.since() >= oldest) continue;
      oldest = povray.since();
      from = group.get();
      which = i;
    }
  }
  if (from == nullptr) return false;
  drop(*from, which);
  from->wanted = from->workers.size();
  return true;
}

// ---- events

void PovrayPool::turn(int wake_fd) {
  hand_out();
  staff();
  if (!obstacle_.empty()) return;

  std::vector<pollfd> fds{{wake_fd, POLLIN, 0}, {signals_.get(), POLLIN, 0}, {files_.get(), POLLIN, 0}};
  for (const auto& group : groups_) {
    for (Worker& worker : group->workers) {
      worker.polled = fds.size();
      fds.push_back({worker.povray->child().end_fd(), POLLIN, 0});
      fds.push_back({worker.errors_open ? worker.povray->child().errors_fd() : -1, POLLIN, 0});
    }
  }
  if (::poll(fds.data(), fds.size(), wait_ms()) < 0 && errno != EINTR) base::throw_errno("poll");

  if (fds[1].revents != 0) {
    std::array<signalfd_siginfo, 16> ignored{};  // signals merge: each lease is checked
    while (::read(signals_.get(), ignored.data(), sizeof ignored) > 0) {
    }
  }
  take_images();  // before the ends of processes: one may have closed its image and died
  for (const auto& group : groups_) {
    for (std::size_t i = group->workers.size(); i-- > 0 && obstacle_.empty();) {
      Worker& worker = group->workers[i];
      worker.povray->look();
      const std::size_t end = worker.polled;
      if (fds[end + 1].revents != 0) worker.errors_open = worker.povray->drain_errors();
      if (fds[end].revents != 0) ended(*group, i);
    }
  }
  check_time();
  hand_out();
  std::erase_if(groups_, [](const auto& group) { return group->queue.empty() && group->workers.empty(); });
}

int PovrayPool::wait_ms() const {
  auto next = SteadyTime::max();
  const auto by = [&next](SteadyTime since, std::chrono::nanoseconds after) {
    if (after < SteadyTime::max() - since) next = std::min(next, since + after);
  };
  for (const auto& group : groups_) {
    for (const Worker& worker : group->workers) {
      const HeldPovray& povray = *worker.povray;
      by(povray.since(), povray.state() == State::kWaiting ? idle_ : povray_.timeout());
      if (povray.state() == State::kComing && povray.is_open()) by(std::chrono::steady_clock::now(), kRetakeAfter);
    }
  }
  if (next == SteadyTime::max()) return -1;
  return base::milliseconds_until(next);
}

void PovrayPool::take_images() {
  alignas(inotify_event) std::array<char, 16384> buffer{};
  while (obstacle_.empty()) {
    const auto got = ::read(files_.get(), buffer.data(), buffer.size());
    if (got <= 0) return;
    for (std::size_t at = 0; at < std::size_t(got) && obstacle_.empty();) {
      const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      at += sizeof(inotify_event) + event->len;
      if ((event->mask & IN_Q_OVERFLOW) != 0) obstacle_ = "inotify lost events";
      if ((event->mask & IN_CLOSE_WRITE) == 0) continue;
      const std::string_view name(event->name);
      if (!name.ends_with(".ppm")) continue;  // POV-Ray stores its progress in another file
      for (const auto& group : groups_) {
        for (std::size_t i = 0; i < group->workers.size(); ++i) {
          if (group->workers[i].watch != event->wd) continue;
          image_closed(*group, i);
          break;
        }
      }
    }
  }
}

void PovrayPool::image_closed(Group& group, std::size_t index) {
  HeldPovray& povray = *group.workers[index].povray;
  // The image was not ordered: the process does not behave as expected.
  if (povray.state() != State::kDrawing) return drop(group, index);
  const std::size_t most = most_ppm_bytes(*group.view_template);
  const std::string bytes = read_at_most(povray.image(), most);
  std::error_code ignored;
  std::filesystem::remove(povray.image(), ignored);
  Order order = povray.finish();
  ImageResult image = image_from(bytes, order.job);
  if (image) {
    if (order.use && order.job.used) order.job.used(*order.use);
    return order.done(std::move(image));
  }
  if (bytes.size() < most && has_no_room(scratch_.path(), most)) {
    obstacle_ = fmt::format("{} is full", scratch_.path().parent_path().string());
    group.queue.push_front(std::move(order));
    return;
  }
  drop(group, index);
  lose(group, std::move(order), image.error());
}

void PovrayPool::check_time() {
  const auto now = std::chrono::steady_clock::now();
  for (const auto& group : groups_) {
    for (std::size_t i = group->workers.size(); i-- > 0;) {
      HeldPovray& povray = *group->workers[i].povray;
      const auto age = now - povray.since();
      if (povray.state() == State::kWaiting) {
        if (age < idle_) continue;
        drop(*group, i);
        group->wanted = group->workers.size();
        continue;
      }
      if (age < povray_.timeout()) continue;
      std::optional<Order> order = povray.take_order();
      drop(*group, i);
      if (!order && !group->queue.empty()) order = take_next(group->queue);
      if (order) order->done(timeout_error(order->job.label, povray_.timeout()));
    }
  }
}

void PovrayPool::ended(Group& group, std::size_t index) {
  HeldPovray& povray = *group.workers[index].povray;
  while (povray.drain_errors() && povray.child().errors_fd() >= 0) {
    pollfd more{povray.child().errors_fd(), POLLIN, 0};
    if (::poll(&more, 1, 0) <= 0) break;
  }
  const int status = povray.end();
  const std::string errors = povray.errors();
  std::optional<Order> order = povray.take_order();
  const bool was_drawing = order.has_value();
  const bool full = (WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ) || is_write_error(errors);
  drop(group, index);
  if (!order) {
    if (group.queue.empty()) return;
    order = take_next(group.queue);
  }
  if (full) {
    obstacle_ = fmt::format("POV-Ray cannot write to {}", scratch_.path().parent_path().string());
    group.queue.push_front(std::move(*order));
    return;
  }
  const Error error = povray_.bad_end(order->job.label, status, errors);
  const bool refused = WIFEXITED(status) && !HeldScene::is_stale(errors) && !povray_complaint(errors, "").empty();
  if (HeldScene::is_stale(errors) && ++order->stale <= kMaxStale) {
    base::Logger("povray").info("a process read an old pose; its image is started again");
    group.queue.push_front(std::move(*order));
    return;
  }
  if (!refused) return lose(group, std::move(*order), error);
  order->done(error);
  if (was_drawing) return;
  // The process stopped before the pose, so it would stop with every other pose, too.
  for (Order& other : std::exchange(group.queue, {})) other.done(error);
}

void PovrayPool::lose(Group& group, Order order, Error error) {
  if (++order.failures > kMaxRetries) {
    order.done(std::move(error));
  } else {
    base::Logger("povray").warning("an image was lost with its process and is started again: " + error.message);
    group.queue.push_front(std::move(order));
  }
}

void PovrayPool::drop(Group& group, std::size_t index) {
  const auto worker = group.workers.begin() + std::ptrdiff_t(index);
  const std::filesystem::path folder = worker->povray->folder();
  group.workers.erase(worker);
  std::error_code ignored;  // the files go with the scratch folder
  std::filesystem::remove_all(folder, ignored);
}

}  // namespace twocone::sim_povray
