// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/image_sender.h"

#include <sys/socket.h>

#include <algorithm>
#include <cassert>
#include <exception>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/server/socket.h"

namespace twocone::sim_povray::server {
namespace {

/// It is not possible to wait for several futures: one is waited for this long, then all are checked.
constexpr std::chrono::milliseconds kImageSlice{5};

ImageResult result_of(const std::shared_future<ImageResult>& image) {
  try {
    return image.get();
  } catch (const std::exception& error) {  // a promise that was dropped
    return Error{ErrorCode::kDisconnected, fmt::format("the image was given up: {}", error.what())};
  }
}

}  // namespace

bool ImageSlots::occupy(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  assert(slot < busy_.size());
  if (busy_[slot]) return false;
  busy_[slot] = true;
  return true;
}

void ImageSlots::release(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  busy_[slot] = false;
}

bool ImageSlots::is_any_busy() {
  const std::lock_guard lock(mutex_);
  return std::find(busy_.begin(), busy_.end(), true) != busy_.end();
}

Status ImageSlots::write(std::uint32_t slot, const Image& image) {
  const std::span<std::uint8_t> room = frames_.write(slot);
  if (image.width_px != size_.width_px || image.height_px != size_.height_px ||
      image.bytes.size() != image_bytes(image.format, image.width_px, image.height_px) ||
      image.bytes.size() > room.size()) {
    return Error{ErrorCode::kBadData, fmt::format("the image is of {} x {} pixels, {} x {} were asked for",
                                                  image.width_px, image.height_px, size_.width_px, size_.height_px)};
  }
  std::copy(image.bytes.begin(), image.bytes.end(), room.begin());
  return {};
}

ImageSender::ImageSender(int socket) : socket_(socket), thread_([this] { work(); }) {}

ImageSender::~ImageSender() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ImageSender::add(Order order) {
  {
    const std::lock_guard lock(mutex_);
    added_.push_back(std::move(order));
  }
  changed_.notify_all();
}

void ImageSender::work() {
  std::vector<Order> waiting;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      // The destructor ends this wait; the time limit only prevents a wait without an end.
      if (waiting.empty())
        changed_.wait_for(lock, std::chrono::seconds(1), [this] { return stopping_ || !added_.empty(); });
      if (stopping_) return;
      std::move(added_.begin(), added_.end(), std::back_inserter(waiting));
      added_.clear();
    }
    if (waiting.empty()) continue;
    waiting.front().image.wait_for(kImageSlice);
    for (auto order = waiting.begin(); order != waiting.end();) {
      if (order->image.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
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

bool ImageSender::deliver(const Order& order) const {
  const ImageResult image = result_of(order.image);
  const Status written = image ? order.slots->write(order.slot, **image) : Status(image.error());
  // Released before the notification: the client may use the slot again immediately.
  order.slots->release(order.slot);
  const Message message = written ? Message(ImageDone{order.order, (*image)->format})
                                  : ImageFailed{order.order, written.error().code, written.error().message};
  return send_message(socket_, message, in(kSendTime)).has_value();
}

}  // namespace twocone::sim_povray::server
