// SPDX-License-Identifier: Apache-2.0
// Measures the accuracy of a run on emulated devices:
//   join_truth RUN WORLD.CSV TRUTH.TUM
// RUN is the run folder, and WORLD.CSV is the table of emulated_world. The frames of the run are found in the table by
// the pixels of their two images, so no two clocks need to agree. The program writes the true pose of each frame at the
// run's own time, and prints a line NAME VALUE for each figure. The errors are computed as in the run's summary, but
// only for fixes that are not ambiguous.
//   join_truth RUN
// prints them for a simulated run, which contains its truth.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/tables/tables.h"
#include "tests/vm/images.h"

namespace twocone::vm {
namespace {

namespace fs = std::filesystem;

struct Step {
  std::uint64_t number = 0;
  double exposed_s = 0, sent_s = 0;
  runlog::PoseRow pose;
  std::string contact;
  std::uint64_t lower = 0, upper = 0;  ///< fingerprints
};

std::vector<Step> read_steps(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::vector<Step> steps;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<std::string> fields;
    std::istringstream rest(line);
    for (std::string field; std::getline(rest, field, ',');) fields.push_back(field);
    if (fields.size() != 9)
      throw std::runtime_error(fmt::format("{}: a row of {} fields", file.string(), fields.size()));
    steps.push_back({std::stoull(fields[0]),
                     std::stod(fields[1]),
                     std::stod(fields[2]),
                     {0, std::stod(fields[3]), std::stod(fields[4]), std::stod(fields[5])},
                     fields[6],
                     std::stoull(fields[7], nullptr, 16),
                     std::stoull(fields[8], nullptr, 16)});
  }
  return steps;
}

std::uint64_t fingerprint_of(const fs::path& file) {
  const auto image = runlog::read_image(file);
  if (!image) throw std::runtime_error(image.error().message);
  const auto print = fingerprint(*image);
  if (!print) throw std::runtime_error(file.string() + ": " + print.error().message);
  return *print;
}

/// The number of the first step with this image, for a message.
std::string first_with(const std::vector<Step>& all, std::uint64_t Step::*view, std::uint64_t print) {
  const auto it = std::find_if(all.begin(), all.end(), [&](const Step& i) { return i.*view == print; });
  return it == all.end() ? "none" : std::to_string(it->number);
}

/// The world's step of each of the run's frames; each is before that of the next frame. None for a frame whose two
/// images do not belong to one step. A stopped robot takes equal images: the cameras' count then selects the step, if
/// possible.
std::vector<std::optional<Step>> steps_of(const runlog::RunData& run, const std::vector<Step>& all) {
  std::vector<std::optional<Step>> found(run.frames.size());
  auto end = all.end();
  for (std::size_t i = run.frames.size(); i-- > 0;) {
    const runlog::FrameRow& frame = run.frames[i];
    const std::uint64_t lower = fingerprint_of(runlog::lower_image_file(run.folder, frame.frame));
    const std::uint64_t upper = fingerprint_of(runlog::upper_image_file(run.folder, frame.frame));
    const auto is_it = [&](const Step& step) { return step.lower == lower && step.upper == upper; };
    const auto latest = std::find_if(std::reverse_iterator(end), all.rend(), is_it);
    if (latest == all.rend()) {
      std::cout << fmt::format("frame {}: its lower image is of step {}, its upper one of {}\n", frame.frame,
                               first_with(all, &Step::lower, lower), first_with(all, &Step::upper, upper));
      continue;
    }
    auto it = std::prev(latest.base());
    if (i + 1 < found.size() && found[i + 1]) {
      const auto steps = std::int64_t(run.frames[i + 1].lower_sequence - frame.lower_sequence);
      if (steps > 0 && steps <= end - all.begin() && is_it(*(end - steps))) it = end - steps;
    }
    found[i] = *it;
    end = it;
  }
  return found;
}

/// Steps of the world between the run's frames, which the run did not get.
struct Losses {
  std::uint64_t lost = 0;
  std::uint64_t reported = 0;  ///< reported as lost by both cameras
};

/// Counts losses from the second frame on, because v4l2loopback always counts its first image as number 0.
Losses losses_of(const runlog::RunData& run, const std::vector<std::optional<Step>>& steps) {
  Losses losses;
  for (std::size_t i = 2; i < steps.size(); ++i) {
    if (!steps[i] || !steps[i - 1]) continue;
    const std::uint64_t lost = steps[i]->number - steps[i - 1]->number - 1;
    losses.lost += lost;
    losses.reported += std::min(run.frames[i].lower_lost, run.frames[i].upper_lost);
  }
  return losses;
}

/// Fills in the truth that a simulated run contains.
void add_truth(runlog::RunData& run, const std::vector<std::optional<Step>>& steps) {
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    if (!steps[i]) continue;
    runlog::PoseRow pose = steps[i]->pose;
    pose.t_s = run.frames[i].t_s;
    run.truth.push_back(pose);
    for (runlog::FixRow& fix : run.fixes) {
      if (fix.frame != run.frames[i].frame) continue;
      fix.true_x_m = pose.x_m;
      fix.true_y_m = pose.y_m;
      if (fix.x_m && fix.y_m) fix.error_m = std::hypot(*fix.x_m - pose.x_m, *fix.y_m - pose.y_m);
    }
  }
}

/// Removes ambiguous fixes, for both kinds of runs: a frame with two possible poses has no single fix and so no error.
int drop_ambiguous(runlog::RunData& run) {
  const auto rows = std::erase_if(run.fixes, [](const runlog::FixRow& fix) { return fix.verdict == "ambiguous"; });
  return int(rows) / 2;
}

void print_figures(runlog::RunData run) {
  const int ambiguous = drop_ambiguous(run);
  const runlog::Summary summary = runlog::summarise(run);
  const auto print = [](const char* name, double value) { std::cout << fmt::format("{} {}\n", name, value); };
  double worst_skew_s = 0;
  for (const runlog::FrameRow& frame : run.frames) worst_skew_s = std::max(worst_skew_s, std::abs(frame.skew_s));
  print("frames", summary.frames);
  print("fixes", summary.frames_with_fix);
  print("ambiguous", ambiguous);
  print("duration_s", summary.duration_s);
  print("worst_skew_s", worst_skew_s);
  if (summary.travelled_m) print("travelled_m", *summary.travelled_m);
  for (const auto& [name, error] : {std::pair{"fix", summary.fix_error},
                                    {"estimate", summary.estimate_error},
                                    {"odometry", summary.odometry_error}}) {
    if (error) std::cout << fmt::format("{0}_mean_m {1}\n{0}_max_m {2}\n", name, error->mean, error->max);
  }
}

void join(const fs::path& folder, const fs::path& table, const fs::path& truth) {
  runlog::RunData run = runlog::read_run(folder);
  const auto steps = steps_of(run, read_steps(table));
  add_truth(run, steps);
  std::ofstream out(truth);
  for (const runlog::PoseRow& pose : run.truth) out << runlog::to_line(pose) << '\n';
  if (!out.flush()) throw std::runtime_error(truth.string() + ": cannot be written");
  double delay_s = 0;
  int touches = 0;
  for (const auto& step : steps) {
    if (!step) continue;
    delay_s += (step->sent_s - step->exposed_s) / double(run.truth.size());
    if (!step->contact.empty()) ++touches;
  }
  const Losses losses = losses_of(run, steps);
  std::cout << fmt::format("of_one_step {}\nmean_delay_s {}\nframes_in_touch {}\nlost {}\nlost_reported {}\n",
                           run.truth.size(), delay_s, touches, losses.lost, losses.reported);
  print_figures(run);
}

}  // namespace
}  // namespace twocone::vm

int main(int argc, char** argv) {
  if (argc != 2 && argc != 4) {
    std::cerr << "usage: join_truth RUN [WORLD.CSV TRUTH.TUM]\n";
    return 2;
  }
  try {
    if (argc == 4) {
      twocone::vm::join(argv[1], argv[2], argv[3]);
    } else {
      twocone::vm::print_figures(twocone::runlog::read_run(argv[1]));
    }
  } catch (const std::exception& error) {
    std::cerr << "join_truth: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
