// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/link/picture_sender.h"

#include <sys/socket.h>

#include <algorithm>
#include <cassert>
#include <exception>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/link/socket.h"

namespace twocone::sim_povray::link {
namespace {

/// A future can be waited for, several cannot: so one is waited for this long, then all are looked at.
constexpr std::chrono::milliseconds kSlice{5};
/// A client reads at once; one that has not for so long is stuck.
constexpr std::chrono::seconds kSendTime{5};

ImageResult result_of(const std::shared_future<ImageResult>& picture) {
  try {
    return picture.get();
  } catch (const std::exception& error) {  // a promise that was dropped
    return Error{ErrorCode::kDisconnected, fmt::format("the picture was given up: {}", error.what())};
  }
}

}  // namespace

bool PictureSlots::occupy(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  assert(slot < busy_.size());
  if (busy_[slot]) return false;
  busy_[slot] = true;
  return true;
}

void PictureSlots::release(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  busy_[slot] = false;
}

bool PictureSlots::is_any_busy() {
  const std::lock_guard lock(mutex_);
  return std::find(busy_.begin(), busy_.end(), true) != busy_.end();
}

Status PictureSlots::write(std::uint32_t slot, const Image& picture) {
  const std::span<std::uint8_t> room = frames_.write(slot);
  if (picture.width_px != size_.width_px || picture.height_px != size_.height_px ||
      picture.bytes.size() != picture_bytes(picture.format, picture.width_px, picture.height_px) ||
      picture.bytes.size() > room.size()) {
    return Error{ErrorCode::kBadData,
                 fmt::format("the picture is of {} x {} pixels, {} x {} were asked for", picture.width_px,
                             picture.height_px, size_.width_px, size_.height_px)};
  }
  std::copy(picture.bytes.begin(), picture.bytes.end(), room.begin());
  return {};
}

PictureSender::PictureSender(int socket) : socket_(socket), thread_([this] { work(); }) {}

PictureSender::~PictureSender() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PictureSender::add(Order order) {
  {
    const std::lock_guard lock(mutex_);
    added_.push_back(std::move(order));
  }
  changed_.notify_all();
}

void PictureSender::work() {
  std::vector<Order> waiting;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      // The destructor ends this wait; the time only keeps it from being one without an end.
      if (waiting.empty())
        changed_.wait_for(lock, std::chrono::seconds(1), [this] { return stopping_ || !added_.empty(); });
      if (stopping_) return;
      std::move(added_.begin(), added_.end(), std::back_inserter(waiting));
      added_.clear();
    }
    if (waiting.empty()) continue;
    waiting.front().picture.wait_for(kSlice);
    for (auto order = waiting.begin(); order != waiting.end();) {
      if (order->picture.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        ++order;
        continue;
      }
      if (!deliver(*order)) {
        ::shutdown(socket_, SHUT_RDWR);
        return;
      }
      order = waiting.erase(order);
    }
  }
}

bool PictureSender::deliver(const Order& order) const {
  const ImageResult picture = result_of(order.picture);
  Status written;
  if (picture) {
    written = order.slots->write(order.slot, **picture);
  } else {
    written = picture.error();
  }
  // Before it is told of: the client may use the slot again at once.
  order.slots->release(order.slot);
  Message message = PictureFailed{};
  if (written) {
    message = PictureDone{order.order, (*picture)->format};
  } else {
    message = PictureFailed{order.order, written.error().code, written.error().message};
  }
  return send_message(socket_, message, std::chrono::steady_clock::now() + kSendTime).has_value();
}

}  // namespace twocone::sim_povray::link
