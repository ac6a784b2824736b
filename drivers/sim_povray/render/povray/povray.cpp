// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/povray.h"

#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/log.h"
#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/place.h"

namespace twocone::sim_povray {
namespace {

namespace fs = std::filesystem;

/// Largest header of a PPM; POV-Ray writes about 140 bytes.
constexpr std::size_t kMaxPpmHeader = 4096;

/// Returns the program's environment without the variables that would change an image: POV-Ray reads defaults from
/// POVINI, ./povray.ini, the home folder and the system, whichever it finds first. The system's file states where the
/// standard include files are.
std::vector<std::string> clean_environment() {
  std::vector<std::string> variables = base::own_environment();
  std::erase_if(variables, [](const std::string& variable) {
    const std::string name = variable.substr(0, variable.find('='));
    return name == "POVINI" || name == "LC_ALL" || name == "LANGUAGE";
  });
  variables.emplace_back("LC_ALL=C");
  if (const std::string ini = system_ini(); !ini.empty()) variables.push_back(fmt::format("POVINI={}", ini));
  return variables;
}

/// Refuses a string of the scene that names a file which the scene may not read. It does not find names that the scene
/// puts together.
Status check_named_files(const SceneCalls& calls, const SceneAccess& access) {
  for (const WrittenString& string : calls.strings) {
    const fs::path file = string.text.empty() ? fs::path() : access.find(string.text);
    if (file.empty() || access.may_read(file)) continue;
    return Error(ErrorCode::kRefused, "{}:{}: {}", string.file, string.line, SceneAccess::refusal(file));
  }
  return {};
}

// On a very busy machine POV-Ray gives up before it has read its scene: its threads have not started within some
// seconds.
constexpr int kMostStarts = 3;

bool has_not_begun(const base::ChildResult& run) {
  return run.end == base::ChildResult::End::kEnded && run.wait_status != 0 &&
         run.errors.find("Timed out waiting for worker thread startup") != std::string::npos;
}

}  // namespace

Result<std::string> find_povray(const std::string& name) {
  const auto missing = [](const std::string& why) {
    return Error(ErrorCode::kUnavailable, "POV-Ray is not installed: {}; on Debian: apt install povray", why);
  };
  const auto program = base::find_program(name);
  if (!program) return missing(fmt::format("no program '{}' in PATH", name));
  std::error_code error;
  if (!fs::is_regular_file(*program, error) || ::access(program->c_str(), X_OK) != 0) {
    return missing(fmt::format("'{}' is no program", name));
  }
  return fs::absolute(*program).string();
}

Povray::Povray(std::string program, const fs::path& scene_path, std::chrono::nanoseconds timeout, SceneLimits limits)
    : program_(std::move(program)),
      scene_path_(scene_path.string()),
      folder_(fs::absolute(scene_path).parent_path().string()),
      timeout_(timeout),
      environment_(clean_environment()),
      limits_(std::move(limits)) {}

Result<Povray> confined_povray(const PlaceSettings& place, const SceneCalls& calls) {
  auto program = find_povray(place.render.povray);
  if (!program) return program.error();
  for (const fs::path& folder : place.scene_paths) {
    std::error_code error;
    if (fs::is_directory(folder, error)) continue;
    return Error(ErrorCode::kNotFound, "scene_paths names no folder: {}", folder.string());
  }
  auto access = std::make_shared<SceneAccess>(place.scene, place.scene_paths);
  for (const std::string& folder : calls.folders) access->look_in(folder);
  std::vector<std::string> readable = needed_to_run(*program);
  readable.insert(readable.end(), access->readable().begin(), access->readable().end());
  auto confinement = std::make_shared<const base::Confinement>(std::move(readable), place.render.landlock);
  if (confinement->kind() != base::Confinement::Kind::kLandlock) {
    base::Logger("povray").warning(describe_confinement(place));
    if (auto inside = check_named_files(calls, *access); !inside) return inside.error();
  }
  return Povray(*std::move(program), place.scene, place.render.timeout, {std::move(confinement), std::move(access)});
}

Result<Povray> confined_povray(const PlaceSettings& place, const Scene& scene) {
  return confined_povray(place, find_calls(scene, SceneAccess(place.scene, place.scene_paths)));
}

std::string describe_confinement(const PlaceSettings& place) {
  const SceneAccess access(place.scene, place.scene_paths);
  switch (base::Confinement({}, place.render.landlock).kind()) {
    case base::Confinement::Kind::kLandlock:
      return fmt::format(
          "POV-Ray is confined by the kernel (Landlock, version {}): it reads {} and its libraries, and writes nothing "
          "but its images",
          base::landlock_version(), fmt::join(access.readable(), ", "));
    case base::Confinement::Kind::kNoWriting:
      return fmt::format(
          "POV-Ray is confined in part (this kernel has no Landlock): it can write no file (seccomp); a file that the "
          "scene names in its text must be in {} or POV-Ray's libraries, but a name that the scene puts together is "
          "not checked",
          fmt::join(access.readable(), ", "));
    case base::Confinement::Kind::kNone:
      break;
  }
  return "POV-Ray is not confined: this kernel has no Landlock, and there is no seccomp filter for this processor: "
         "render scenes that you trust only";
}

std::vector<std::string> povray_arguments(const ViewTemplate& view_template) {
  std::vector<std::string> arguments{
      fmt::format("+I{}", kSceneFile),
      "+FP",              // PPM: needs no unpacking and no library
      "File_Gamma=sRGB",  // as Image requires
      "-UA",
      fmt::format("+W{}", view_template.width_px),
      fmt::format("+H{}", view_template.height_px),
      "-D",
      "-P",
      "-V",
      "+WT1",  // one thread: area lights and radiosity are the same every time
      "+BM2",  // bounding by BSP tree: a fifth faster here; docs/renderers.md says what the others show
      fmt::format("+Q{}", view_template.quality),
      "-GD",
      "-GR",
      "-GS",  // the fatal and the warning stream stay: they report errors of the scene, with their lines
  };
  if (view_template.antialias > 1) {
    // Where neighbours differ by more than 0.03, n x n rays are sent without jitter. Compared with n x n rays for all
    // pixels (+A0.0), this leaves 0.12 % of an indoor image's pixels off by more than 2 of 255, for 40 % of the time;
    // +A0.1 leaves 0.9 %, for 33 %.
    arguments.insert(arguments.end(), {"+A0.03", "+AM1", fmt::format("+R{}", view_template.antialias), "-J"});
  } else {
    arguments.emplace_back("-A");
  }
  if (view_template.window) {
    // POV-Ray counts from 1, and takes a number up to 1 as a share of the image, so the image's edges are left out.
    const Window& w = *view_template.window;
    if (w.first_column > 0) arguments.push_back(fmt::format("+SC{}", w.first_column + 1));
    if (w.last_column < view_template.width_px - 1) arguments.push_back(fmt::format("+EC{}", w.last_column + 1));
    if (w.first_row > 0) arguments.push_back(fmt::format("+SR{}", w.first_row + 1));
    if (w.last_row < view_template.height_px - 1) arguments.push_back(fmt::format("+ER{}", w.last_row + 1));
  }
  return arguments;
}

RenderJob plain_image(std::string label, std::string scene, int width_px, int height_px, int antialias) {
  ViewTemplate view_template{
      .scene = std::move(scene), .width_px = width_px, .height_px = height_px, .antialias = antialias};
  return {std::move(label), std::make_shared<const ViewTemplate>(std::move(view_template)), {}};
}

std::string with_pose(const ViewTemplate& view_template, std::string_view text) {
  // Blanks are added around a text that is not empty. Without poses, a view template stays the same to the byte.
  std::string scene = view_template.scene;
  if (!text.empty()) scene.insert(view_template.pose_offset, fmt::format(" {} ", text));
  return scene;
}

std::size_t most_ppm_bytes(const ViewTemplate& view_template) {
  return std::size_t(view_template.width_px) * std::size_t(view_template.height_px) * 3 + kMaxPpmHeader;
}

base::Program Povray::program(const ViewTemplate& view_template) const {
  base::Program program{program_,           povray_arguments(view_template), environment_, folder_, {}, true,
                        limits_.confinement};
  if (limits_.access) {
    for (const fs::path& folder : limits_.access->extra_folders()) {
      program.arguments.push_back(fmt::format("+L{}", folder.string()));
    }
  }
  return program;
}

std::string Povray::hold_obstacle() const {
  if (limits_.confinement == nullptr || limits_.confinement->kind() == base::Confinement::Kind::kLandlock) return {};
  return "this kernel has no Landlock, and a process that is held would have to be allowed to write files";
}

Error Povray::bad_end(const std::string& label, int wait_status, const std::string& errors) const {
  Error error = exit_error(label, wait_status, errors, scene_path_);
  if (limits_.access == nullptr) return error;
  // For images and fonts, POV-Ray names the file in a message of its own.
  std::string advice = limits_.access->advice(error.message);
  if (advice.empty()) advice = limits_.access->advice(missing_file(errors));
  if (!advice.empty()) error.message += fmt::format(" ({})", advice);
  return error;
}

Result<base::ChildResult> Povray::run(const RenderJob& job, const RunKind& kind, std::size_t most, int stop_fd) const {
  base::UniqueFd scene;
  try {
    scene = base::sealed_file("scene.pov", with_pose(*job.view_template, job.pose));
  } catch (const std::system_error& e) {
    return Error(ErrorCode::kUnavailable, "{}: no memory for the scene: {}", job.label, e.what());
  }
  base::ChildRequest request;
  request.program = program(*job.view_template);
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
  base::ChildResult run = base::run_child(request);
  for (int start = 1; start < kMostStarts && has_not_begun(run); ++start) run = base::run_child(request);

  switch (run.end) {
    case base::ChildResult::End::kNotStarted:
      return Error(ErrorCode::kUnavailable, "{}: POV-Ray ({}) could not be started: {}", job.label, program_,
                   run.errors);
    case base::ChildResult::End::kStopped:
      return closed_error(job.label, "finished");
    case base::ChildResult::End::kTimedOut:
      return timeout_error(job.label, timeout_);
    case base::ChildResult::End::kTooMuch:
      return Error(ErrorCode::kBadData, "{}: POV-Ray wrote more than an image of {} x {} pixels and was killed",
                   job.label, job.view_template->width_px, job.view_template->height_px);
    case base::ChildResult::End::kEnded:
      break;
  }
  if (run.wait_status != 0 && !kind.is_question) return bad_end(job.label, run.wait_status, run.errors);
  return run;
}

ImageResult Povray::render(const RenderJob& job, int stop_fd) const {
  const auto done = run(job, {}, most_ppm_bytes(*job.view_template), stop_fd);
  if (!done) return done.error();
  ImageResult image = image_from(done->output, job);
  if (image && done->use) job.used(*done->use);
  return image;
}

Result<DeepImage> Povray::render_deep(const std::string& label, const std::string& scene, int width_px,
                                      int height_px) const {
  const RenderJob job = plain_image(label, scene, width_px, height_px, 1);
  const auto done = run(job, {.is_deep = true}, 2 * most_ppm_bytes(*job.view_template), -1);
  if (!done) return done.error();
  return deep_image_from(done->output, job);
}

Result<std::string> Povray::ask(const std::string& label, std::string scene, int stop_fd) const {
  const RenderJob job = plain_image(label, std::move(scene), 1, 1, 1);
  const auto done = run(job, {.is_question = true}, most_ppm_bytes(*job.view_template), stop_fd);
  if (!done) return done.error();
  const std::string complaint = povray_complaint(done->errors, scene_path_);
  const auto answer = complaint.find(kPovrayAnswer);
  if (answer == std::string::npos) return bad_end(label, done->wait_status, done->errors);
  return complaint.substr(answer + std::string_view(kPovrayAnswer).size());
}

}  // namespace twocone::sim_povray
