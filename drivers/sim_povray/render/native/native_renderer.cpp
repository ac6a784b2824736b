// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/native_renderer.h"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/hash.h"

namespace twocone::sim_povray {
namespace {

namespace fs = std::filesystem;

std::chrono::nanoseconds thread_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// Returns what changes when a program is replaced.
std::string version_of(const fs::path& program) {
  std::error_code error;
  const fs::path file = fs::canonical(program, error);
  return fmt::format("{} {} {}", file.string(), fs::file_size(file, error),
                     fs::last_write_time(file, error).time_since_epoch().count());
}

/// Makes an empty file. Without it, the next run only takes a second longer.
void remember(const fs::path& file) {
  if (file.empty()) return;
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  std::ofstream(file).flush();
}

Image black(const NativeView& view) {
  const std::size_t pixels = std::size_t(view.width_px()) * std::size_t(view.height_px());
  return {view.width_px(), view.height_px(), PixelFormat::kRgb8, Bytes(std::vector<std::uint8_t>(3 * pixels))};
}

}  // namespace

fs::path user_cache() {
  for (const auto& [variable, below] : {std::pair{"XDG_CACHE_HOME", "twocone"}, std::pair{"HOME", ".cache/twocone"}}) {
    const char* const folder = std::getenv(variable);
    if (folder != nullptr && fs::path(folder).is_absolute()) return fs::path(folder) / below;
  }
  return {};
}

std::vector<std::size_t> differing_pixels(const Image& a, const Image& b) {
  std::vector<std::size_t> pixels;
  for (std::size_t i = 0; i + 2 < a.bytes.size(); i += 3) {
    bool differs = false;
    for (std::size_t k = i; k < i + 3; ++k) differs = differs || std::abs(int(a.bytes[k]) - int(b.bytes[k])) > 1;
    if (differs) pixels.push_back(i / 3);
  }
  return pixels;
}

Image plain_image_of(const NativeView& view, const Poses& poses) {
  Image image = black(view);
  const NativeView::Moment moment = view.at(poses);
  for (int band = 0; band < view.bands(); ++band) view.render_plain(moment, band, image);
  return image;
}

class NativeRenderer::SpareImages : public std::enable_shared_from_this<SpareImages> {
 public:
  /// Returns an image of the view that is black outside the view's window.
  std::shared_ptr<Image> take(const NativeView& view) {
    std::unique_ptr<Image> image;
    {
      const std::lock_guard lock(mutex_);
      auto& of_view = images_[&view];
      if (!of_view.empty()) {
        image = std::move(of_view.back());
        of_view.pop_back();
      }
    }
    if (!image) image = std::make_unique<Image>(black(view));
    // The last user may outlive the renderer, but not its spare images.
    return {image.release(), [self = shared_from_this(), of = &view](Image* done) {
              const std::lock_guard lock(self->mutex_);
              self->images_[of].emplace_back(done);
            }};
  }

 private:
  std::mutex mutex_;
  std::map<const NativeView*, std::vector<std::unique_ptr<Image>>> images_;
};

/// An image in the making: workers take its bands one by one.
struct NativeRenderer::Task {
  Order order;
  std::shared_ptr<const NativeView> view;
  std::optional<NativeView::Moment> moment;
  std::shared_ptr<Image> image;
  std::optional<PixelTruth> truth;
  int next_band = 0, end_band = 0;  // under mutex_, as is the next
  int open_bands = 0;
  std::atomic<std::chrono::nanoseconds::rep> cpu{0};
};

NativeRenderer::NativeRenderer(NativeSettings settings, std::optional<Reference> reference)
    : settings_(std::move(settings)),
      spare_images_(std::make_shared<SpareImages>()),
      reference_(std::move(reference)) {}

NativeRenderer::~NativeRenderer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.raise();
  changed_.notify_all();
  for (std::thread& worker : workers_) worker.join();
  for (Order& order : held_) order.done(closed_error(order.job.label, "started"));
  for (const auto& task : tasks_) task->order.done(closed_error(task->order.job.label, "finished"));
}

std::shared_ptr<void> NativeRenderer::expect_view() {
  const std::lock_guard lock(mutex_);
  ++expected_;
  // The pointer's value does not matter, only that it is released.
  return {static_cast<void*>(this), [this](void* /*self*/) { release(); }};
}

void NativeRenderer::release() {
  std::deque<Order> ready;
  std::optional<RendererKind> choice;
  {
    const std::lock_guard lock(mutex_);
    if (--expected_ > 0) return;
    ready = std::exchange(held_, {});
    const RendererKind now = obstacle_.empty() || !reference_ ? RendererKind::kNative : RendererKind::kPovray;
    if (!std::exchange(is_chosen_, true)) choice = now;
  }
  if (choice && settings_.chosen) settings_.chosen(*choice, reference_.has_value());
  for (Order& order : ready) start(std::move(order));
}

void NativeRenderer::prepare(const std::shared_ptr<const ViewTemplate>& view_template, const std::string& pose) {
  std::string read_files;
  SceneAccess access = settings_.access;
  const IncludeReader read = [reader = include_reader(access), &read_files](const std::string& name) {
    auto file = reader(name);
    if (file) read_files += fmt::format("{} {:x}\n", file->path, base::fnv1a(file->text));
    return file;
  };
  auto view = NativeView::make(*view_template, settings_.scene.string(), read);
  std::string obstacle;
  if (!view) {
    obstacle = view.error().message;
  } else if (reference_) {
    const fs::path memory = remembered(*view_template, read_files);
    std::error_code error;
    if (!fs::exists(memory, error)) {
      obstacle = difference(**view, *view_template, pose);
      if (obstacle.empty()) remember(memory);
    }
  }
  const std::lock_guard lock(mutex_);
  if (view) {
    views_[view_template.get()] = *view;
    templates_.push_back(view_template);
  }
  if (obstacle.empty() || !obstacle_.empty()) return;
  obstacle_ = obstacle;
  if (settings_.notice && reference_) settings_.notice("POV-Ray renders, because " + obstacle);
}

fs::path NativeRenderer::remembered(const ViewTemplate& view_template, const std::string& read_files) const {
  if (settings_.cache.empty()) return {};
  const std::string of = fmt::format("{}\n{}\n{}x{} q{}\n{}\n{}", version_of("/proc/self/exe"),
                                     version_of(reference_->povray.program_path()), view_template.width_px,
                                     view_template.height_px, view_template.quality, read_files, view_template.scene);
  return settings_.cache / "agreed" / fmt::format("{:016x}", base::fnv1a(of));
}

std::string NativeRenderer::difference(const NativeView& view, const ViewTemplate& view_template,
                                       const std::string& pose) const {
  std::string plain = difference(view, view_template, pose, Smoothing::kNone);
  if (!plain.empty() || view_template.antialias == 1) return plain;
  return difference(view, view_template, pose, Smoothing::kAsOrdered);
}

std::string NativeRenderer::difference(const NativeView& view, const ViewTemplate& view_template,
                                       const std::string& pose, Smoothing smoothing) const {
  const auto poses = parse_poses(pose);
  if (!poses) return "the first pose cannot be read";
  const bool is_plain = smoothing == Smoothing::kNone;
  ViewTemplate compared = view_template;
  if (is_plain) compared.antialias = 1;
  const auto expected = reference_->povray.render(
      {"first image, for comparison", std::make_shared<const ViewTemplate>(std::move(compared)), pose, {}}, stop_.fd());
  if (!expected) return expected.error().message;
  Image image = is_plain ? plain_image_of(view, *poses) : black(view);
  const NativeView::Moment moment = view.at(*poses);
  for (int band = 0; band < view.bands() && !is_plain; ++band) view.render(moment, band, image);
  const std::size_t off = differing_pixels(image, **expected).size();
  const std::size_t mirror = view.mirror_pixels();
  const std::size_t of = mirror > 0 ? mirror : image.bytes.size() / 3;
  if (double(off) <= (is_plain ? kMostDifferent : kMostDifferentSmoothed) * double(of)) return {};
  return fmt::format("the native renderer's first {}image differs from its in {} of {} pixels of the {}",
                     is_plain ? "" : "smoothed ", off, of, mirror > 0 ? "mirror" : "image");
}

void NativeRenderer::submit(RenderJob job, Done done) {
  {
    const std::lock_guard lock(mutex_);
    if (expected_ > 0) {
      held_.push_back({std::move(job), std::move(done)});
      return;
    }
  }
  start({std::move(job), std::move(done)});
}

void NativeRenderer::start(Order order) {
  auto task = std::make_shared<Task>();
  std::string why;
  {
    const std::lock_guard lock(mutex_);
    const auto view = views_.find(order.job.view_template.get());
    if (obstacle_.empty() && view != views_.end()) task->view = view->second;
    why = obstacle_;
  }
  if (!task->view) {
    if (order.job.truth) {
      return order.done(Error(ErrorCode::kRefused, "{}: only the native renderer knows what its pixels show, but {}",
                              order.job.label, reference_ ? "POV-Ray renders, because " + why : why));
    }
    if (reference_) return reference_->renderer->submit(std::move(order.job), std::move(order.done));
    return order.done(Error(ErrorCode::kRefused, "{}: {}", order.job.label, why));
  }
  auto poses = parse_poses(order.job.pose);
  if (!poses) return order.done(Error(ErrorCode::kBadData, "{}: its pose cannot be read", order.job.label));
  task->moment.emplace(task->view->at(*std::move(poses)));
  task->image = spare_images_->take(*task->view);
  if (order.job.truth) {
    auto truth = task->view->empty_truth();
    if (!truth) return order.done(with_name(order.job.label, truth.error()));
    task->truth = *std::move(truth);
  }
  task->order = std::move(order);
  task->end_band = task->view->bands();
  if (const auto& rows = task->order.job.rows) std::tie(task->next_band, task->end_band) = task->view->bands_of(*rows);
  task->open_bands = task->end_band - task->next_band;
  {
    const std::lock_guard lock(mutex_);
    try {
      while (workers_.size() < std::max(1U, std::thread::hardware_concurrency())) {
        workers_.emplace_back([this] { work(); });
      }
    } catch (const std::system_error& e) {  // the machine has no thread left: the existing ones do it
      if (workers_.empty()) {
        return task->order.done(
            Error(ErrorCode::kUnavailable, "{}: no thread is available: {}", task->order.job.label, e.what()));
      }
    }
    tasks_.push_back(std::move(task));
  }
  changed_.notify_all();
}

void NativeRenderer::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !tasks_.empty(); });
    if (stopping_) return;
    const std::shared_ptr<Task> task = tasks_.front();
    const int band = task->next_band++;
    if (task->next_band == task->end_band) tasks_.pop_front();
    lock.unlock();
    const auto begin = thread_time();
    task->view->render(*task->moment, band, *task->image, task->truth ? &*task->truth : nullptr);
    task->cpu += (thread_time() - begin).count();
    lock.lock();
    if (--task->open_bands > 0) continue;
    lock.unlock();
    const RenderJob& job = task->order.job;
    if (task->truth) job.truth(*std::move(task->truth));
    if (job.used) job.used({std::chrono::nanoseconds(task->cpu.load()), 0});
    task->order.done(std::shared_ptr<const Image>(std::move(task->image)));
    lock.lock();
  }
}

std::string NativeRenderer::describe() const {
  const std::lock_guard lock(mutex_);
  if (obstacle_.empty()) return reference_ ? "native, compared with POV-Ray" : "native, unchecked";
  return reference_ ? fmt::format("{} (not native: {})", reference_->renderer->describe(), obstacle_) : obstacle_;
}

}  // namespace twocone::sim_povray
