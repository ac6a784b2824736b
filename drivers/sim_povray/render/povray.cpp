// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray.h"

#include <string.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "drivers/sim_povray/render/child_process.h"

namespace twocone::sim_povray {
namespace {

namespace fs = std::filesystem;

const std::string kSceneFd = fmt::format("/proc/self/fd/{}", kChildInput);

/// Most that stands in a PPM before the pixels; POV-Ray writes about 140 bytes.
constexpr std::size_t kMaxPpmHeader = 4096;

bool is_program(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && ::access(path.c_str(), X_OK) == 0;
}

/// Names, so that a message reads the same in every language and C library.
std::string signal_name(int number) {
  const char* name = ::sigabbrev_np(number);
  return name == nullptr ? fmt::format("signal {}", number) : fmt::format("SIG{}", name);
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
  for (const char* ini : {"/etc/povray/3.7/povray.ini", "/usr/local/etc/povray/3.7/povray.ini"}) {
    if (::access(ini, R_OK) == 0) {
      result.push_back(fmt::format("POVINI={}", ini));
      break;
    }
  }
  return result;
}

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f'; }

/// Reads the next number of a PPM's header.
std::optional<int> header_number(std::string_view bytes, std::size_t& at) {
  while (at < bytes.size() && (is_space(bytes[at]) || bytes[at] == '#')) {
    if (bytes[at] == '#') at = std::min(bytes.find('\n', at), bytes.size());
    if (at < bytes.size()) ++at;
  }
  int number = 0;
  const char* begin = bytes.data() + at;
  const auto [end, error] = std::from_chars(begin, bytes.data() + bytes.size(), number);
  if (error != std::errc()) return std::nullopt;
  at += std::size_t(end - begin);
  return number;
}

struct Complaint {
  std::string file;
  std::string line;
  std::string text;
};

/// Takes `File 'F' line N: TEXT` apart.
std::optional<Complaint> placed_complaint(std::string_view message) {
  constexpr std::string_view kFile = "File '";
  constexpr std::string_view kLine = "' line ";
  if (!message.starts_with(kFile)) return std::nullopt;
  const auto file_end = message.find(kLine);
  if (file_end == std::string_view::npos) return std::nullopt;
  const auto line_begin = file_end + kLine.size();
  const auto line_end = message.find(": ", line_begin);
  if (line_end == std::string_view::npos) return std::nullopt;
  return Complaint{std::string(message.substr(kFile.size(), file_end - kFile.size())),
                   std::string(message.substr(line_begin, line_end - line_begin)),
                   std::string(message.substr(line_end + 2))};
}

/// The messages in `errors`, unfolded: POV-Ray breaks lines before a blank, which it keeps, or within a long word.
std::vector<std::string> unfolded(std::string_view errors) {
  std::vector<std::string> messages;
  bool open = false;
  while (!errors.empty()) {
    const auto end = std::min(errors.find('\n'), errors.size());
    const std::string_view line = errors.substr(0, end);
    errors.remove_prefix(std::min(end + 1, errors.size()));
    const bool begins = line.starts_with("File '") || line.starts_with("Fatal error");
    const bool other = line.empty() || line.starts_with("====") || line.starts_with("Render failed");
    if (begins) {
      messages.emplace_back(line);
    } else if (open && !other) {
      messages.back().append(line);
    }
    open = begins || (open && !other);
  }
  return messages;
}

std::string last_line(std::string_view errors) {
  while (!errors.empty() && is_space(errors.back())) errors.remove_suffix(1);
  const auto newline = errors.rfind('\n');
  return std::string(newline == std::string_view::npos ? errors : errors.substr(newline + 1));
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

Povray::Povray(std::string program, const fs::path& scene_path, std::chrono::nanoseconds timeout)
    : program_(std::move(program)),
      scene_path_(scene_path.string()),
      folder_(fs::absolute(scene_path).parent_path().string()),
      timeout_(timeout),
      environment_(clean_environment()) {}

std::vector<std::string> povray_arguments(const RenderJob& job) {
  std::vector<std::string> arguments{
      "+I" + kSceneFd,
      "+O-",
      "+FP",              // PPM: nothing to unpack, and no library
      "File_Gamma=sRGB",  // what Image promises
      "-UA",
      fmt::format("+W{}", job.width_px),
      fmt::format("+H{}", job.height_px),
      "-D",
      "-P",
      "-V",
      "+WT1",  // one thread: area lights and radiosity come out the same every time
      "+Q9",
      "-GD",
      "-GR",
      "-GS",  // the fatal and the warning stream stay: they name what is wrong with the scene, and where
  };
  if (job.antialias > 1) {
    // Where neighbours differ by more than 0.03, n x n rays without jitter. Against all pixels n x n (+A0.0) this
    // leaves 0.12 % of an indoor picture's pixels off by more than 2 of 255, for 40 % of the time; +A0.1 0.9 %, for 33
    // %.
    arguments.insert(arguments.end(), {"+A0.03", "+AM1", fmt::format("+R{}", job.antialias), "-J"});
  } else {
    arguments.emplace_back("-A");
  }
  return arguments;
}

ImageResult Povray::render(const RenderJob& job, int stop_fd) const {
  const auto error = [&job](ErrorCode code, const std::string& what) {
    return Error{code, fmt::format("{}: {}", job.label, what)};
  };
  UniqueFd scene;
  try {
    scene = memory_file("scene.pov", job.scene);
  } catch (const std::system_error& e) {
    return error(ErrorCode::kUnavailable, fmt::format("no memory for the scene: {}", e.what()));
  }
  ChildRequest request;
  request.program = program_;
  request.arguments = povray_arguments(job);
  request.environment = environment_;
  request.folder = folder_;
  request.input_fd = scene.get();
  request.max_output = std::size_t(job.width_px) * std::size_t(job.height_px) * 3 + kMaxPpmHeader;
  request.timeout = timeout_;
  request.stop_fd = stop_fd;
  const ChildResult run = run_child(request);

  switch (run.end) {
    case ChildResult::End::kNotStarted:
      return error(ErrorCode::kUnavailable, fmt::format("POV-Ray ({}) could not be started: {}: {}", program_,
                                                        run.errors, std::generic_category().message(run.number)));
    case ChildResult::End::kStopped:
      return error(ErrorCode::kDisconnected, "the simulation was closed before POV-Ray had finished");
    case ChildResult::End::kTimedOut:
      return error(ErrorCode::kTimeout, fmt::format("POV-Ray did not finish within {} s and was killed",
                                                    std::chrono::duration<double>(timeout_).count()));
    case ChildResult::End::kTooMuch:
      return error(ErrorCode::kBadData,
                   fmt::format("POV-Ray wrote more than a picture of {} x {} pixels and was killed", job.width_px,
                               job.height_px));
    case ChildResult::End::kSignalled:
      return error(ErrorCode::kDisconnected, fmt::format("POV-Ray crashed ({})", signal_name(run.number)));
    case ChildResult::End::kExited:
      break;
  }
  if (run.number != 0) {
    const std::string complaint = povray_complaint(run.errors, scene_path_);
    if (!complaint.empty()) return Error{ErrorCode::kRefused, complaint};
    const std::string last = last_line(run.errors);
    return error(ErrorCode::kRefused, fmt::format("POV-Ray stopped with exit status {}{}", run.number,
                                                  last.empty() ? " and no message" : ": " + last));
  }
  auto image = parse_ppm(run.output);
  if (!image) return error(image.error().code, "POV-Ray's picture: " + image.error().message);
  if (image->width_px != job.width_px || image->height_px != job.height_px) {
    return error(ErrorCode::kBadData, fmt::format("POV-Ray's picture is {} x {} pixels instead of {} x {}",
                                                  image->width_px, image->height_px, job.width_px, job.height_px));
  }
  return std::make_shared<const Image>(std::move(*image));
}

Result<Image> parse_ppm(std::string_view bytes) {
  const auto bad = [](const std::string& what) { return Error{ErrorCode::kBadData, what}; };
  if (!bytes.starts_with("P6")) return bad("no PPM (P6)");
  std::size_t at = 2;
  std::array<int, 3> header{};
  for (int& number : header) {
    const auto read = header_number(bytes, at);
    if (!read || *read <= 0) return bad("its header is cut off or wrong");
    number = *read;
  }
  const auto [width_px, height_px, deepest] = header;
  if (deepest != 255) return bad(fmt::format("{} levels instead of 255", deepest));
  if (at >= bytes.size() || !is_space(bytes[at])) return bad("its header is cut off or wrong");
  const std::string_view pixels = bytes.substr(at + 1);
  const std::size_t expected = std::size_t(width_px) * std::size_t(height_px) * 3;
  if (pixels.size() != expected) {
    return bad(fmt::format("{} bytes of pixels instead of {}", pixels.size(), expected));
  }
  return Image{width_px, height_px, PixelFormat::kRgb8, {pixels.begin(), pixels.end()}};
}

std::string povray_complaint(std::string_view errors, const std::string& scene_path) {
  std::optional<Complaint> possible;
  std::string fatal;
  for (const std::string& message : unfolded(errors)) {
    if (message.starts_with("Fatal error")) fatal = message;
    auto complaint = placed_complaint(message);
    if (!complaint) continue;
    if (complaint->file == kSceneFd) complaint->file = scene_path;
    if (complaint->text.starts_with("Parse Error:")) {
      return fmt::format("{}:{}: POV-Ray: {}", complaint->file, complaint->line, complaint->text);
    }
    // Of a missing picture POV-Ray says no more than this. (Other "Possible Parse Errors" are warnings.)
    if (!possible && complaint->text.starts_with("Possible Parse Error: Cannot find")) possible = complaint;
  }
  if (fatal.empty()) return {};
  if (possible) return fmt::format("{}:{}: POV-Ray: {}", possible->file, possible->line, possible->text);
  return fmt::format("{}: POV-Ray: {}", scene_path, fatal);
}

}  // namespace twocone::sim_povray
