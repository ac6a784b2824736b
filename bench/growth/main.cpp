// SPDX-License-Identifier: Apache-2.0
// Measures how times grow with robots, frames, pixels, objects and landmarks, for the tables of docs/performance.md.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>

#include "apps/runlog/version.h"
#include "bench/growth/growth.h"
#include "tests/support/temporary_folder.h"

namespace twocone::bench {
namespace {

struct Part {
  const char* name;
  std::vector<std::function<Growth(const Options&)>> tables;
};
const std::vector<Part>& parts() {
  static const std::vector<Part> all{{"robots", {grow_robots, grow_robots_with_a_process_a_view}},
                                     {"robots-error", {grow_error_by_robots}},
                                     {"frames", {grow_frames}},
                                     {"pixels", {grow_pixels}},
                                     {"objects", {grow_objects}},
                                     {"landmarks", {grow_vision_landmarks, grow_localisation_landmarks}}};
  return all;
}

void measure(Options options, const std::vector<std::string>& wanted) {
  const testing_support::TemporaryFolder folder;
  options.scratch = folder.path();
  fmt::print("twocone {}, commit {}, {}; {} processors.\n", runlog::version(), runlog::commit(), runlog::compiler(),
             std::thread::hardware_concurrency());
  fmt::print(
      "Each cell: the median, and the lowest and the highest of the repeats. Exponents: least squares over the "
      "logarithms of the medians, with 95 % intervals.\n");
  for (const Part& part : parts()) {
    if (std::find(wanted.begin(), wanted.end(), part.name) == wanted.end()) continue;
    std::fprintf(stderr, "%s\n", part.name);
    for (const auto& table : part.tables) {
      fmt::print("\n{}", markdown(table(options)));
      std::fflush(stdout);
    }
  }
}

}  // namespace

int run(int argc, char** argv) {
  Options options;
  std::vector<std::string> names;
  for (const Part& part : parts()) names.emplace_back(part.name);
  std::vector<std::string> wanted = names;
  int run_frames = 0;
  CLI::App app("How times grow with robots, frames, pixels, objects and landmarks, as markdown");
  app.add_option("--parts", wanted, "Which")->delimiter(',')->check(CLI::IsMember(names))->capture_default_str();
  app.add_option("--repeats", options.repeats, "Of each size")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--processes", options.processes, "POV-Ray processes of the first table of robots")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--run-alone", run_frames, "For its own use: one run in this process")->group("");
  app.add_option("--scratch", options.scratch, "For its own use: where")->group("");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  if (run_frames > 0) {
    run_alone(run_frames, options.scratch);
    return 0;
  }
#ifndef NDEBUG
  std::fputs("warning: a debug build\n", stderr);
#endif
  measure(options, wanted);
  return 0;
}

}  // namespace twocone::bench

int main(int argc, char** argv) {
  try {
    return twocone::bench::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "growth_bench: %s\n", e.what());
    return 1;
  }
}
