// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/pool_renderer.h"

#include <signal.h>

#include <exception>
#include <system_error>
#include <utility>

#include "base/log.h"
#include "drivers/sim_povray/place.h"

namespace twocone::sim_povray {

ProcessRenderer::ProcessRenderer(Povray povray, int processes) : povray_(std::move(povray)), processes_(processes) {}

ProcessRenderer::~ProcessRenderer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.raise();
  changed_.notify_all();
  for (auto& worker : workers_) worker.join();
  for (Order& order : waiting_) order.done(closed_error(order.job.label, "started"));
}

void ProcessRenderer::submit(RenderJob job, Done done) {
  {
    const std::lock_guard lock(mutex_);
    const bool all_busy = workers_.size() < std::size_t(busy_) + waiting_.size() + 1;
    if (all_busy && workers_.size() < std::size_t(processes_)) {
      try {
        workers_.emplace_back([this] { work(); });
      } catch (const std::system_error& e) {  // the machine has no thread left: the existing ones do it
        if (workers_.empty()) {
          done(Error(ErrorCode::kUnavailable, "{}: no thread is available: {}", job.label, e.what()));
          return;
        }
      }
    }
    waiting_.push_back({std::move(job), std::move(done)});
  }
  changed_.notify_one();
}

void ProcessRenderer::work() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    const Order next = std::move(waiting_.front());
    waiting_.pop_front();
    ++busy_;
    lock.unlock();
    ImageResult image = Error{ErrorCode::kUnavailable, next.job.label + ": out of memory"};
    try {
      image = povray_.render(next.job, stop_.fd());
    } catch (const std::exception& e) {  // std::bad_alloc: nothing else is thrown
      image = Error(ErrorCode::kUnavailable, "{}: {}", next.job.label, e.what());
    }
    next.done(std::move(image));
    lock.lock();
    --busy_;
  }
}

PoolRenderer::PoolRenderer(Povray povray, PoolSettings settings, std::string obstacle)
    : povray_(std::move(povray)),
      settings_(std::move(settings)),
      one_by_one_(povray_, settings_.processes),
      obstacle_(std::move(obstacle)) {}

PoolRenderer::~PoolRenderer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.raise();
  if (thread_.joinable()) thread_.join();
  for (Order& order : inbox_) order.done(closed_error(order.job.label, "started"));
}

void PoolRenderer::submit(RenderJob job, Done done) {
  {
    const std::lock_guard lock(mutex_);
    if (!job.view_template->one_shot.empty()) {
      one_shot_ = job.view_template->one_shot;
    } else if (obstacle_.empty()) {
      try {
        if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
        inbox_.push_back({std::move(job), std::move(done), submitted_++});
        wake_.raise();
        return;
      } catch (const std::system_error& e) {
        obstacle_ = e.what();
      }
    }
  }
  give_notice();
  one_by_one_.submit(std::move(job), std::move(done));
}

void PoolRenderer::give_notice() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(noticed_, true)) return;
  }
  if (settings_.notice) settings_.notice(describe());
}

std::string PoolRenderer::describe() const {
  const std::lock_guard lock(mutex_);
  if (!obstacle_.empty()) return one_by_one_.describe() + ": " + obstacle_;
  std::string text = "POV-Ray processes are held between images";
  if (!one_shot_.empty()) text += "; " + one_by_one_.describe() + " where " + one_shot_;
  return text;
}

void PoolRenderer::work() {
  // None of the program's signals is handled here; the signal of the leases is read, not handled.
  sigset_t all;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
  try {
    hold();
  } catch (const std::exception& e) {
    fall_back(e.what(), {});
  }
}

void PoolRenderer::hold() {
  PovrayPool pool(povray_, settings_);
  while (pool.obstacle().empty()) {
    wake_.lower();
    std::vector<Order> orders;
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
      orders = std::exchange(inbox_, {});
    }
    for (Order& order : orders) pool.add(std::move(order));
    pool.turn(wake_.fd());
  }
  fall_back(pool.obstacle(), pool.give_back());
}

void PoolRenderer::fall_back(std::string why, std::vector<Order> orders) {
  base::Logger("povray").warning("one process for each image from here on: " + why);
  {
    const std::lock_guard lock(mutex_);
    obstacle_ = std::move(why);
    for (Order& order : inbox_) orders.push_back(std::move(order));
    inbox_.clear();
  }
  give_notice();
  for (Order& order : orders) one_by_one_.submit(std::move(order.job), std::move(order.done));
}

std::unique_ptr<Renderer> make_renderer(Povray povray, const RenderSettings& settings) {
  if (!settings.hold) return std::make_unique<ProcessRenderer>(std::move(povray), settings.processes);
  PoolSettings pool{.processes = settings.processes, .notice = settings.notice};
  std::string obstacle = povray.hold_obstacle();
  if (obstacle.empty()) obstacle = lease_obstacle();
  return std::make_unique<PoolRenderer>(std::move(povray), pool, std::move(obstacle));
}

}  // namespace twocone::sim_povray
