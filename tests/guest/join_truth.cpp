// SPDX-License-Identifier: Apache-2.0
// How well a robot on stood-in devices knew where it was:
//   join_truth RUN WORLD.CSV TRUTH.TUM
// RUN is its run folder, WORLD.CSV what stand_in_world wrote meanwhile. A frame of the run is known again in it by the
// pixels of its two pictures, so no two clocks need to agree. Writes the true pose of each frame at the run's own time,
// and prints a line NAME VALUE for each figure; those of the errors are made as the run's summary makes its own, but of
// fixes that are not ambiguous.
//   join_truth RUN
// prints them of a simulated run, which has its truth with it.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/runs/run_folder.h"
#include "apps/runs/summary.h"
#include "apps/runs/tables.h"
#include "tests/guest/pictures.h"

namespace twocone::guest {
namespace {

namespace fs = std::filesystem;

struct Instant {
  std::uint64_t number = 0;
  double exposed_s = 0, sent_s = 0;
  runs::PoseRow pose;
  std::string contact;
  std::uint64_t lower = 0, upper = 0;  ///< fingerprints
};

std::vector<Instant> read_instants(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::vector<Instant> instants;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<std::string> fields;
    std::istringstream rest(line);
    for (std::string field; std::getline(rest, field, ',');) fields.push_back(field);
    if (fields.size() != 9)
      throw std::runtime_error(fmt::format("{}: a row of {} fields", file.string(), fields.size()));
    instants.push_back({std::stoull(fields[0]),
                        std::stod(fields[1]),
                        std::stod(fields[2]),
                        {0, std::stod(fields[3]), std::stod(fields[4]), std::stod(fields[5])},
                        fields[6],
                        std::stoull(fields[7], nullptr, 16),
                        std::stoull(fields[8], nullptr, 16)});
  }
  return instants;
}

std::uint64_t fingerprint_of(const fs::path& picture) {
  const auto image = runs::read_picture(picture);
  if (!image) throw std::runtime_error(image.error().message);
  const auto print = fingerprint(*image);
  if (!print) throw std::runtime_error(picture.string() + ": " + print.error().message);
  return *print;
}

/// For a person.
std::string first_with(const std::vector<Instant>& all, std::uint64_t Instant::*view, std::uint64_t print) {
  const auto it = std::find_if(all.begin(), all.end(), [&](const Instant& i) { return i.*view == print; });
  return it == all.end() ? "none" : std::to_string(it->number);
}

/// The instant of each of the run's frames, each before that of the next frame; none for a frame whose pictures are not
/// those of one. A robot that stands shows the same again: the cameras' count then says which it is, if it can be.
std::vector<std::optional<Instant>> instants_of(const runs::RunData& run, const std::vector<Instant>& all) {
  std::vector<std::optional<Instant>> found(run.frames.size());
  auto end = all.end();
  for (std::size_t i = run.frames.size(); i-- > 0;) {
    const runs::FrameRow& frame = run.frames[i];
    const std::uint64_t lower = fingerprint_of(runs::lower_picture(run.folder, frame.frame));
    const std::uint64_t upper = fingerprint_of(runs::upper_picture(run.folder, frame.frame));
    const auto is_it = [&](const Instant& instant) { return instant.lower == lower && instant.upper == upper; };
    const auto latest = std::find_if(std::reverse_iterator(end), all.rend(), is_it);
    if (latest == all.rend()) {
      std::cout << fmt::format("frame {}: its lower picture is of instant {}, its upper one of {}\n", frame.frame,
                               first_with(all, &Instant::lower, lower), first_with(all, &Instant::upper, upper));
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

/// Instants of the world between the run's frames, which it did not get.
struct Losses {
  std::uint64_t lost = 0;
  std::uint64_t told = 0;  ///< as lost, by both cameras
};

/// From the second frame on: v4l2loopback counts its first picture as number 0, whichever it is.
Losses losses_of(const runs::RunData& run, const std::vector<std::optional<Instant>>& instants) {
  Losses losses;
  for (std::size_t i = 2; i < instants.size(); ++i) {
    if (!instants[i] || !instants[i - 1]) continue;
    const std::uint64_t lost = instants[i]->number - instants[i - 1]->number - 1;
    losses.lost += lost;
    losses.told += std::min(run.frames[i].lower_lost, run.frames[i].upper_lost);
  }
  return losses;
}

/// Fills in what a simulation would have known.
void add_truth(runs::RunData& run, const std::vector<std::optional<Instant>>& instants) {
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    if (!instants[i]) continue;
    runs::PoseRow pose = instants[i]->pose;
    pose.t_s = run.frames[i].t_s;
    run.truth.push_back(pose);
    for (runs::FixRow& fix : run.fixes) {
      if (fix.frame != run.frames[i].frame) continue;
      fix.true_x_m = pose.x_m;
      fix.true_y_m = pose.y_m;
      if (fix.x_m && fix.y_m) fix.error_m = std::hypot(*fix.x_m - pose.x_m, *fix.y_m - pose.y_m);
    }
  }
}

/// A frame that answers with two places has not one fix, and no error of one: the same for both kinds of runs.
int drop_ambiguous(runs::RunData& run) {
  const auto rows = std::erase_if(run.fixes, [](const runs::FixRow& fix) { return fix.verdict == "ambiguous"; });
  return int(rows) / 2;
}

void print_figures(runs::RunData run) {
  const int ambiguous = drop_ambiguous(run);
  const runs::Summary summary = runs::summarise(run);
  const auto print = [](const char* name, double value) { std::cout << fmt::format("{} {}\n", name, value); };
  double worst_skew_s = 0;
  for (const runs::FrameRow& frame : run.frames) worst_skew_s = std::max(worst_skew_s, std::abs(frame.skew_s));
  print("frames", summary.frames);
  print("fixes", summary.frames_with_fix);
  print("ambiguous", ambiguous);
  print("duration_s", summary.duration_s);
  print("worst_skew_s", worst_skew_s);
  if (summary.travelled_m) print("travelled_m", *summary.travelled_m);
  for (const auto& [name, error] : {std::pair{"fix", summary.fix_error},
                                    {"estimate", summary.estimate_error},
                                    {"odometry", summary.odometry_error}}) {
    if (error) std::cout << fmt::format("{0}_mean_m {1}\n{0}_max_m {2}\n", name, error->mean_m, error->max_m);
  }
}

void join(const fs::path& folder, const fs::path& table, const fs::path& truth) {
  runs::RunData run = runs::read_run(folder);
  const auto instants = instants_of(run, read_instants(table));
  add_truth(run, instants);
  std::ofstream out(truth);
  for (const runs::PoseRow& pose : run.truth) out << runs::to_line(pose) << '\n';
  if (!out.flush()) throw std::runtime_error(truth.string() + ": cannot be written");
  double delay_s = 0;
  int touches = 0;
  for (const auto& instant : instants) {
    if (!instant) continue;
    delay_s += (instant->sent_s - instant->exposed_s) / double(run.truth.size());
    if (!instant->contact.empty()) ++touches;
  }
  const Losses losses = losses_of(run, instants);
  std::cout << fmt::format("of_one_instant {}\nmean_delay_s {}\nframes_in_touch {}\nlost {}\nlost_told {}\n",
                           run.truth.size(), delay_s, touches, losses.lost, losses.told);
  print_figures(run);
}

}  // namespace
}  // namespace twocone::guest

int main(int argc, char** argv) {
  if (argc != 2 && argc != 4) {
    std::cerr << "usage: join_truth RUN [WORLD.CSV TRUTH.TUM]\n";
    return 2;
  }
  try {
    if (argc == 4) {
      twocone::guest::join(argv[1], argv[2], argv[3]);
    } else {
      twocone::guest::print_figures(twocone::runs::read_run(argv[1]));
    }
  } catch (const std::exception& error) {
    std::cerr << "join_truth: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
