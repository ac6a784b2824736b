// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/povray.h"

#include <string.h>
#include <sys/wait.h>

#include <array>
#include <charconv>
#include <optional>
#include <sstream>
#include <vector>

#include <fmt/format.h>

namespace twocone::sim_povray {
namespace {

/// Returns the name of a signal, so that a message reads the same in every language and C library.
std::string signal_name(int number) {
  const char* name = ::sigabbrev_np(number);
  return name == nullptr ? fmt::format("signal {}", number) : fmt::format("SIG{}", name);
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

  [[nodiscard]] std::string message() const { return fmt::format("{}:{}: POV-Ray: {}", file, line, text); }
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

/// Returns the messages in `errors`, unfolded: POV-Ray breaks lines before a blank, which it keeps, or within a long
/// word.
std::vector<std::string> unfolded(const std::string& errors) {
  std::vector<std::string> messages;
  bool open = false;
  std::istringstream lines(errors);
  for (std::string line; std::getline(lines, line);) {
    const bool begins = line.starts_with("File '") || line.starts_with("Fatal error");
    const bool other = line.empty() || line.starts_with("====") || line.starts_with("Render failed");
    if (begins) {
      messages.push_back(line);
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

struct Ppm {
  int width_px = 0;
  int height_px = 0;
  std::string_view pixels;
};

/// Parses a PPM. @param levels greatest value of a channel: 255 or 65535. Errors: kBadData
Result<Ppm> take_ppm_apart(std::string_view bytes, int levels) {
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
  if (deepest != levels) return bad(fmt::format("{} levels instead of {}", deepest, levels));
  if (at >= bytes.size() || !is_space(bytes[at])) return bad("its header is cut off or wrong");
  const std::string_view pixels = bytes.substr(at + 1);
  const std::size_t expected = std::size_t(width_px) * std::size_t(height_px) * (levels > 255 ? 6 : 3);
  if (pixels.size() != expected) {
    return bad(fmt::format("{} bytes of pixels instead of {}", pixels.size(), expected));
  }
  return Ppm{width_px, height_px, pixels};
}

/// Returns a parsed image, if it is valid and of the size that was ordered.
template <typename Image>
Result<Image> as_ordered(Result<Image> image, const RenderJob& job) {
  if (!image) {
    return Error(image.error().code, "{}: POV-Ray's image: {}", job.label, image.error().message);
  }
  if (image->width_px != job.view_template->width_px || image->height_px != job.view_template->height_px) {
    return Error(ErrorCode::kBadData, "{}: POV-Ray's image is {} x {} pixels instead of {} x {}", job.label,
                 image->width_px, image->height_px, job.view_template->width_px, job.view_template->height_px);
  }
  return image;
}

}  // namespace

Result<Image> parse_ppm(std::string_view bytes) {
  const auto ppm = take_ppm_apart(bytes, 255);
  if (!ppm) return ppm.error();
  return Image{ppm->width_px, ppm->height_px, PixelFormat::kRgb8, {ppm->pixels.begin(), ppm->pixels.end()}};
}

Result<DeepImage> parse_deep_ppm(std::string_view bytes) {
  const auto ppm = take_ppm_apart(bytes, 65535);
  if (!ppm) return ppm.error();
  DeepImage image{ppm->width_px, ppm->height_px, {}};
  image.levels.reserve(ppm->pixels.size() / 2);
  for (std::size_t i = 0; i < ppm->pixels.size(); i += 2) {
    const auto high = static_cast<std::uint8_t>(ppm->pixels[i]);
    const auto low = static_cast<std::uint8_t>(ppm->pixels[i + 1]);
    image.levels.push_back(static_cast<std::uint16_t>(high << 8 | low));
  }
  return image;
}

std::string povray_complaint(const std::string& errors, const std::string& scene_path) {
  std::optional<Complaint> possible;
  std::optional<Complaint> last;
  std::string fatal;
  for (const std::string& message : unfolded(errors)) {
    if (message.starts_with("Fatal error")) fatal = message;
    auto complaint = placed_complaint(message);
    if (!complaint) continue;
    if (complaint->file == kSceneFile) complaint->file = scene_path;
    if (complaint->text.starts_with("Parse Error:")) return complaint->message();
    if (complaint->text.find("assumed_gamma") == std::string::npos) last = complaint;
    // For a missing image file, POV-Ray reports only this. (Other "Possible Parse Errors" are warnings.)
    if (!possible && complaint->text.starts_with("Possible Parse Error: Cannot find")) possible = complaint;
  }
  if (fatal.empty()) return {};
  // If POV-Ray stops without a reason, its last warning gives the reason.
  if (!possible && fatal.find("Uncategorized error") != std::string::npos) possible = last;
  if (possible) return possible->message();
  return fmt::format("{}: POV-Ray: {}", scene_path, fatal);
}

std::string missing_file(const std::string& errors) {
  for (const std::string& message : unfolded(errors)) {
    const auto at = message.find("Cannot find file '");
    if (at != std::string::npos) return message.substr(at);
  }
  return {};
}

Error exit_error(const std::string& label, int wait_status, const std::string& errors, const std::string& scene_path) {
  if (WIFSIGNALED(wait_status)) {
    return Error(ErrorCode::kDisconnected, "{}: POV-Ray crashed ({})", label, signal_name(WTERMSIG(wait_status)));
  }
  const std::string complaint = povray_complaint(errors, scene_path);
  if (!complaint.empty()) return {ErrorCode::kRefused, complaint};
  const std::string last = last_line(errors);
  return Error(ErrorCode::kRefused, "{}: POV-Ray stopped with exit status {}{}", label, WEXITSTATUS(wait_status),
               last.empty() ? " and no message" : ": " + last);
}

Error timeout_error(const std::string& label, std::chrono::nanoseconds timeout) {
  return Error(ErrorCode::kTimeout, "{}: POV-Ray did not finish within {} s and was killed", label,
               std::chrono::duration<double>(timeout).count());
}

Error closed_error(const std::string& label, const char* what) {
  return Error(ErrorCode::kDisconnected, "{}: the simulation was closed before POV-Ray had {}", label, what);
}

ImageResult image_from(std::string_view ppm, const RenderJob& job) {
  auto image = as_ordered(parse_ppm(ppm), job);
  if (!image) return image.error();
  return std::make_shared<const Image>(std::move(*image));
}

Result<DeepImage> deep_image_from(std::string_view ppm, const RenderJob& job) {
  return as_ordered(parse_deep_ppm(ppm), job);
}

}  // namespace twocone::sim_povray
