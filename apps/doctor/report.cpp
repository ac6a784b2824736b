// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/report.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace twocone::doctor {
namespace {

constexpr std::size_t kColumns = 5;
constexpr std::size_t kMeasured = 2;
constexpr std::size_t kGap = 2;
// The widest column "measured" and the narrowest column "what to do". A narrower text leaves its space to the other
// column.
constexpr std::size_t kWidestMeasured = 44;
constexpr std::size_t kLeastAdvice = 24;

using Cells = std::array<std::string, kColumns>;

/// Returns the text in lines of at most `width`. A longer word gets its own line, or is cut if `must_fit`.
std::vector<std::string> wrap(std::string_view text, std::size_t width, bool must_fit) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    std::size_t end = text.find_first_of(" \n");
    std::string word(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (word.empty()) continue;
    if (!lines.empty() && lines.back().size() + 1 + word.size() <= width) {
      lines.back() += " " + word;
      continue;
    }
    while (must_fit && word.size() > width) {
      lines.push_back(word.substr(0, width));
      word.erase(0, width);
    }
    lines.push_back(std::move(word));
  }
  return lines;
}

void print_row(const Cells& cells, const std::array<std::size_t, kColumns>& widths, std::string& text) {
  std::array<std::vector<std::string>, kColumns> lines;
  std::size_t height = 1;
  for (std::size_t i = 0; i < kColumns; ++i) {
    lines[i] = wrap(cells[i], widths[i], i == kMeasured);
    height = std::max(height, lines[i].size());
  }
  for (std::size_t line = 0; line < height; ++line) {
    std::string out;
    for (std::size_t i = 0; i < kColumns; ++i) {
      out += fmt::format("{:<{}}", line < lines[i].size() ? lines[i][line] : "", widths[i] + kGap);
    }
    out.erase(out.find_last_not_of(' ') + 1);
    text += out + "\n";
  }
}

struct Advice {
  ErrorCode code;
  const char* camera;
  const char* drive;
};

constexpr const char* kDisconnected = "it was disconnected: check cable, hub, power";
constexpr const char* kInstall = "install the missing software";
constexpr const char* kOtherMode = "see the message; request a mode that it has";
constexpr const char* kSeeMessage = "see the message";

constexpr std::array kAdvice{
    Advice{ErrorCode::kNotFound, "plug it in; twocone devices lists the available names",
           "plug it in; twocone devices lists the available ports"},
    Advice{ErrorCode::kUnavailable, kInstall, kInstall},
    Advice{ErrorCode::kInvalidState, kOtherMode, kSeeMessage},
    Advice{ErrorCode::kTimeout, "it is connected but sends nothing: check cable, hub, power",
           "check protocol, baud, the controller's power, the cable's RX and TX"},
    Advice{ErrorCode::kDisconnected, kDisconnected, kDisconnected},
    Advice{ErrorCode::kBadData, "its data are no image: check cable and hub",
           "check protocol and baud; keep the cable away from the motors' wires"},
    Advice{ErrorCode::kCancelled, kOtherMode, kSeeMessage},
    Advice{ErrorCode::kRefused, kOtherMode, kSeeMessage},
};

const Advice& advice_for(ErrorCode code) {
  return *std::find_if(kAdvice.begin(), kAdvice.end(), [code](const Advice& a) { return a.code == code; });
}

}  // namespace

std::string_view to_string(Verdict verdict) {
  constexpr std::array<std::string_view, 4> kNames{"ok", "warning", "failed", "not run"};
  return kNames.at(std::size_t(verdict));
}

std::string camera_advice(ErrorCode code) { return advice_for(code).camera; }
std::string drive_advice(ErrorCode code) { return advice_for(code).drive; }

Row failed_row(const std::string& part, const std::string& check, const Error& error, const std::string& advice) {
  std::string message = error.message;
  for (const std::string& name : {"cameras." + part + ": ", part + ": "}) {
    if (message.starts_with(name)) message.erase(0, name.size());
  }
  if (const auto end = message.find("; "); error.code == ErrorCode::kRefused && end != std::string::npos) {
    return {part, check, message.substr(0, end), kFailed, message.substr(end + 2)};
  }
  return {part, check, message, kFailed, advice};
}

Row drive_failed(const std::string& check, const Error& error) {
  return failed_row("drive", check, error, drive_advice(error.code));
}

std::size_t Report::count(Verdict verdict) const {
  return std::size_t(std::ranges::count(rows_, verdict, &Row::verdict));
}

std::string table(const Report& report, std::size_t width) {
  std::vector<Cells> all{{"part", "check", "measured", "verdict", "what to do"}};
  for (const Row& row : report.rows()) {
    all.push_back({row.part, row.check, row.measured, std::string(to_string(row.verdict)), row.advice});
  }
  std::array<std::size_t, kColumns> widths{};
  for (const Cells& cells : all) {
    for (std::size_t i = 0; i < kColumns; ++i) widths[i] = std::max(widths[i], cells[i].size());
  }
  widths[kMeasured] = std::min(widths[kMeasured], kWidestMeasured);
  std::size_t taken = 0;
  for (std::size_t i = 0; i + 1 < kColumns; ++i) taken += widths[i] + kGap;
  widths.back() = std::max(kLeastAdvice, width > taken ? width - taken : 0);
  std::string text;
  for (const Cells& cells : all) print_row(cells, widths, text);
  return text;
}

std::string summary(const Report& report) {
  const std::size_t ok = report.count(kOk);
  if (ok == report.rows().size()) return fmt::format("all {} checks ok", ok);
  const std::size_t warnings = report.count(kWarning);
  return fmt::format("{} ok, {} warning{}, {} failed, {} not run", ok, warnings, warnings == 1 ? "" : "s",
                     report.count(kFailed), report.count(kNotRun));
}

}  // namespace twocone::doctor
