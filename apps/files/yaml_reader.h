// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/node/node.h>

#include "apps/files/map_file.h"

/// Strict reading of YAML: nothing is taken silently, and everything wrong is told at once.
namespace twocone::files {

struct Unit {
  std::string_view symbol;  ///< behind a value: "m"
  std::string_view name;    ///< in words: "metres"
};
inline constexpr Unit kNoUnit{"", ""};
inline constexpr Unit kMetres{"m", "metres"};
inline constexpr Unit kMetresPerSecond{"m/s", "metres a second"};
inline constexpr Unit kRadians{"rad", "radians"};
inline constexpr Unit kSeconds{"s", "seconds"};
inline constexpr Unit kHertz{"Hz", "hertz"};
inline constexpr Unit kPixels{"px", "pixels"};
inline constexpr Unit kKilograms{"kg", "kilograms"};
inline constexpr Unit kElectrons{"e", "electrons"};

/// Finite numbers from `least` to `greatest`.
struct Range {
  double least = -std::numeric_limits<double>::infinity();
  double greatest = std::numeric_limits<double>::infinity();
  bool without_ends = false;  ///< the two themselves are out
  std::string_view words{};   ///< what a message says; empty: made from the numbers
};
inline constexpr Range kAnyNumber{};
inline constexpr Range kAboveZero{.least = 0, .without_ends = true};
inline constexpr Range kZeroOrMore{.least = 0};
/// Of a robot's small parts (wheels, mirrors) and of the robot itself: nothing beyond goes through a door, and 60 is 60
/// mm or 60 cm written as metres.
inline constexpr Range kPartLength{.least = 0, .greatest = 1, .without_ends = true};
inline constexpr Range kRobotLength{.least = 0, .greatest = 5, .without_ends = true};

/// Whether `name` is one or more of a-z, A-Z, 0-9 and `further`.
[[nodiscard]] bool is_name(std::string_view name, std::string_view further);

/// What a number is and may be. `what` completes "is missing: ".
struct Quantity {
  std::string_view what;
  Unit unit;
  Range range;
};

enum class Need { kRequired, kOptional };

class Reading;

/// One mapping of the file. Each reading call notes that its key is known, and returns whether `value` now holds
/// something good: what the file says or, for an absent optional key, what it held before. Otherwise it has complained.
/// @throws only std::bad_alloc: complaints are thrown together, by Reading::finish().
class Section {
 public:
  bool number(std::string_view key, const Quantity& quantity, double& value, Need need = Need::kRequired);
  /// A whole number; the unit's range is kept likewise.
  bool whole(std::string_view key, const Quantity& quantity, int& value, Need need = Need::kRequired);
  /// Not empty. A number is text too.
  bool text(std::string_view key, std::string_view what, std::string& value, Need need = Need::kRequired);
  /// true or false.
  bool flag(std::string_view key, std::string_view what, bool& value, Need need = Need::kRequired);
  /// A list of exactly values.size() numbers.
  bool numbers(std::string_view key, const Quantity& quantity, std::span<double> values, Need need = Need::kRequired);
  /// A number, which counts twice, or a list of two.
  bool number_or_pair(std::string_view key, const Quantity& quantity, std::span<double, 2> values,
                      Need need = Need::kRequired);
  /// A list of one of `counts` numbers.
  bool number_list(std::string_view key, const Quantity& quantity, std::span<const std::size_t> counts,
                   std::vector<double>& values, Need need = Need::kRequired);
  /// A list of texts, none of them empty.
  bool texts(std::string_view key, std::string_view what, std::vector<std::string>& values,
             Need need = Need::kRequired);
  /// A list of [x, y].
  bool points(std::string_view key, std::string_view what, std::vector<Point>& values, Need need = Need::kRequired);
  /// A mapping; null where there is none.
  Section* section(std::string_view key, std::string_view what, Need need = Need::kRequired);
  /// A list of mappings; those that are none are complained about and left out.
  std::vector<Section*> sections(std::string_view key, std::string_view what, Need need = Need::kRequired);

  /// All keys in the file's order, for mappings whose keys are names.
  [[nodiscard]] std::vector<std::string> keys() const;
  /// Whether the key is there; notes it as known.
  bool has(std::string_view key);
  void complain_missing(std::string_view key, std::string_view what, Unit unit = kNoUnit);
  /// "PATH.KEY is VALUE UNIT, must be RULE", at the key's line.
  void complain(std::string_view key, Unit unit, std::string_view rule);
  /// About the mapping itself: "PATH TEXT".
  void complain_here(std::string_view text);

 private:
  friend class Reading;
  struct Entry {
    std::string key;
    int line;  ///< of the key, from 1; 0: unknown
    YAML::Node value;
    bool asked;
  };

  Section(Reading& reading, std::string path, int line, const YAML::Node& mapping);
  Entry* find(std::string_view key);
  Entry* find(std::string_view key, std::string_view what, Unit unit, Need need);
  [[nodiscard]] std::string path_of(std::string_view key) const;
  bool take_number(const YAML::Node& node, int line, const std::string& path, const Quantity& quantity, double& value);
  void complain_unknown() const;

  Reading* reading_;
  std::string path_;  ///< "" for the file itself
  int line_;
  std::vector<Entry> entries_;
  std::vector<std::string> known_;
};

/// The reading of one file: owns its sections and collects what is wrong with them.
class Reading {
 public:
  /// @param file named in messages
  Reading(const YAML::Node& root, const std::filesystem::path& file);
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// The outermost mapping. @throws FileError if there is none
  Section& root();

  /// @throws FileError with every complaint, by line, those about keys that nobody asked for included
  void finish();

 private:
  friend class Section;
  struct Complaint {
    int line;
    std::string text;
  };
  /// Once only: what two parts have in common is told by the first.
  void complain(int line, std::string text);

  std::string file_;
  YAML::Node node_;
  std::deque<Section> sections_;  ///< a deque: sections stay where they are
  std::vector<Complaint> complaints_;
};

/// The one document of a YAML text. @param file named in messages
/// @throws FileError: FILE:LINE:COLUMN for a syntax error; empty; several documents
YAML::Node parse_yaml(const std::string& text, const std::filesystem::path& file);
/// The same of a file. @throws FileError: also as read_text
YAML::Node load_yaml(const std::filesystem::path& file);

}  // namespace twocone::files
