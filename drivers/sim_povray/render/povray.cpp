// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <system_error>

#include <fmt/format.h>

#include "drivers/sim_povray/render/child_process.h"
#include "drivers/sim_povray/render/povray_answer.h"

namespace twocone::sim_povray {
namespace {

namespace fs = std::filesystem;

/// Most that stands in a PPM before the pixels; POV-Ray writes about 140 bytes.
constexpr std::size_t kMaxPpmHeader = 4096;

bool is_program(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && ::access(path.c_str(), X_OK) == 0;
}

/// The program's surroundings, without what would change a picture: POV-Ray reads defaults from POVINI, ./povray.ini,
/// the home folder and the system, whichever it finds first. The system's file tells where the standard include files
/// are.
std::vector<std::string> clean_environment() {
  std::vector<std::string> result;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view variable(*entry);
    const std::string_view name = variable.substr(0, variable.find('='));
    if (name != "POVINI" && name != "LC_ALL" && name != "LANGUAGE") result.emplace_back(variable);
  }
  result.emplace_back("LC_ALL=C");
  if (const std::string ini = system_ini(); !ini.empty()) result.push_back(fmt::format("POVINI={}", ini));
  return result;
}

}  // namespace

Result<std::string> find_povray(const std::string& name) {
  constexpr const char* kAdvice = "on Debian: apt install povray";
  if (name.find('/') != std::string::npos) {
    if (is_program(name)) return fs::absolute(name).string();
    return Error{ErrorCode::kUnavailable,
                 fmt::format("POV-Ray is not installed: '{}' is no program; {}", name, kAdvice)};
  }
  const char* path = std::getenv("PATH");
  std::string_view folders = path == nullptr ? "/usr/local/bin:/usr/bin:/bin" : path;
  while (!folders.empty()) {
    const auto end = std::min(folders.find(':'), folders.size());
    const fs::path program = fs::path(folders.substr(0, end)) / name;
    if (is_program(program)) return fs::absolute(program).string();
    folders.remove_prefix(std::min(end + 1, folders.size()));
  }
  return Error{ErrorCode::kUnavailable,
               fmt::format("POV-Ray is not installed: no program '{}' in PATH; {}", name, kAdvice)};
}

Povray::Povray(std::string program, const fs::path& scene_path, std::chrono::nanoseconds timeout, SceneLimits limits)
    : program_(std::move(program)),
      scene_path_(scene_path.string()),
      folder_(fs::absolute(scene_path).parent_path().string()),
      timeout_(timeout),
      environment_(clean_environment()),
      limits_(std::move(limits)) {}

std::vector<std::string> povray_arguments(const Mould& mould) {
  std::vector<std::string> arguments{
      fmt::format("+I{}", kSceneFile),
      "+FP",              // PPM: nothing to unpack, and no library
      "File_Gamma=sRGB",  // what Image promises
      "-UA",
      fmt::format("+W{}", mould.width_px),
      fmt::format("+H{}", mould.height_px),
      "-D",
      "-P",
      "-V",
      "+WT1",  // one thread: area lights and radiosity come out the same every time
      "+BM2",  // bounding by BSP tree: a fifth faster here; the default (+BM1) loses shadows that -MB and this have
      fmt::format("+Q{}", mould.quality),
      "-GD",
      "-GR",
      "-GS",  // the fatal and the warning stream stay: they name what is wrong with the scene, and where
  };
  if (mould.antialias > 1) {
    // Where neighbours differ by more than 0.03, n x n rays without jitter. Against all pixels n x n (+A0.0) this
    // leaves 0.12 % of an indoor picture's pixels off by more than 2 of 255, for 40 % of the time; +A0.1 0.9 %, for 33
    // %.
    arguments.insert(arguments.end(), {"+A0.03", "+AM1", fmt::format("+R{}", mould.antialias), "-J"});
  } else {
    arguments.emplace_back("-A");
  }
  if (mould.window) {
    // POV-Ray counts from 1, and takes a number up to 1 for a share of the picture: the picture's edges are not said.
    const Window& w = *mould.window;
    if (w.first_column > 0) arguments.push_back(fmt::format("+SC{}", w.first_column + 1));
    if (w.last_column < mould.width_px - 1) arguments.push_back(fmt::format("+EC{}", w.last_column + 1));
    if (w.first_row > 0) arguments.push_back(fmt::format("+SR{}", w.first_row + 1));
    if (w.last_row < mould.height_px - 1) arguments.push_back(fmt::format("+ER{}", w.last_row + 1));
  }
  return arguments;
}

RenderJob plain_picture(std::string label, std::string scene, int width_px, int height_px, int antialias) {
  Mould mould;
  mould.scene = std::move(scene);
  mould.width_px = width_px;
  mould.height_px = height_px;
  mould.antialias = antialias;
  return {std::move(label), std::make_shared<const Mould>(std::move(mould)), {}};
}

std::string with_pose(const Mould& mould, std::string_view text) {
  // Blanks around it, and only if there is something: a mould without poses stays what it is, to the byte.
  std::string scene = mould.scene;
  if (!text.empty()) scene.insert(mould.pose_offset, fmt::format(" {} ", text));
  return scene;
}

std::size_t most_ppm_bytes(const Mould& mould) {
  return std::size_t(mould.width_px) * std::size_t(mould.height_px) * 3 + kMaxPpmHeader;
}

Program Povray::program(const Mould& mould) const {
  Program program{program_, povray_arguments(mould), environment_, folder_, {}, true, limits_.confinement};
  if (limits_.access) {
    for (const fs::path& folder : limits_.access->told()) {
      program.arguments.push_back(fmt::format("+L{}", folder.string()));
    }
  }
  return program;
}

std::string Povray::hold_obstacle() const {
  if (limits_.confinement == nullptr || limits_.confinement->kind() == Confinement::Kind::kLandlock) return {};
  return "this kernel has no Landlock, and a process that is held would have to be allowed to write files";
}

Error Povray::bad_end(const std::string& label, int wait_status, const std::string& errors) const {
  Error error = exit_error(label, wait_status, errors, scene_path_);
  if (limits_.access == nullptr) return error;
  // Of images and fonts POV-Ray names the file in a message of its own.
  std::string advice = limits_.access->advice(error.message);
  if (advice.empty()) advice = limits_.access->advice(missing_file(errors));
  if (!advice.empty()) error.message += fmt::format(" ({})", advice);
  return error;
}

Result<ChildResult> Povray::run(const RenderJob& job, const RunKind& kind, std::size_t most, int stop_fd) const {
  UniqueFd scene;
  try {
    scene = sealed_file("scene.pov", with_pose(*job.mould, job.pose));
  } catch (const std::system_error& e) {
    return Error{ErrorCode::kUnavailable, fmt::format("{}: no memory for the scene: {}", job.label, e.what())};
  }
  ChildRequest request;
  request.program = program(*job.mould);
  std::vector<std::string>& arguments = request.program.arguments;
  if (kind.is_deep) {
    std::replace(arguments.begin(), arguments.end(), std::string("+FP"), std::string("+FP16"));
    std::replace(arguments.begin(), arguments.end(), std::string("File_Gamma=sRGB"), std::string("File_Gamma=1.0"));
  }
  arguments.emplace_back("+O-");
  request.program.inputs = {scene.get()};
  request.max_output = most;
  request.timeout = timeout_;
  request.stop_fd = stop_fd;
  request.measured = bool(job.used);
  ChildResult run = run_child(request);

  switch (run.end) {
    case ChildResult::End::kNotStarted:
      return start_error(job.label, program_, run.errors);
    case ChildResult::End::kStopped:
      return closed_error(job.label, "finished");
    case ChildResult::End::kTimedOut:
      return timeout_error(job.label, timeout_);
    case ChildResult::End::kTooMuch:
      return Error{ErrorCode::kBadData,
                   fmt::format("{}: POV-Ray wrote more than a picture of {} x {} pixels and was killed", job.label,
                               job.mould->width_px, job.mould->height_px)};
    case ChildResult::End::kEnded:
      break;
  }
  if (run.wait_status != 0 && !kind.is_question) return bad_end(job.label, run.wait_status, run.errors);
  return run;
}

ImageResult Povray::render(const RenderJob& job, int stop_fd) const {
  const auto done = run(job, {}, most_ppm_bytes(*job.mould), stop_fd);
  if (!done) return done.error();
  ImageResult picture = picture_from(done->output, job);
  if (picture && done->use) job.used(*done->use);
  return picture;
}

Result<DeepImage> Povray::render_deep(const std::string& label, const std::string& scene, int width_px,
                                      int height_px) const {
  const RenderJob job = plain_picture(label, scene, width_px, height_px, 1);
  const auto done = run(job, {.is_deep = true}, 2 * most_ppm_bytes(*job.mould), -1);
  if (!done) return done.error();
  return deep_picture_from(done->output, job);
}

Result<std::string> Povray::ask(const std::string& label, std::string scene, int stop_fd) const {
  const RenderJob job = plain_picture(label, std::move(scene), 1, 1, 1);
  const auto done = run(job, {.is_question = true}, most_ppm_bytes(*job.mould), stop_fd);
  if (!done) return done.error();
  const std::string complaint = povray_complaint(done->errors, scene_path_);
  const auto answer = complaint.find(kPovrayAnswer);
  if (answer == std::string::npos) return bad_end(label, done->wait_status, done->errors);
  return complaint.substr(answer + std::string_view(kPovrayAnswer).size());
}

}  // namespace twocone::sim_povray
