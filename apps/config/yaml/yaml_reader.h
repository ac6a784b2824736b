// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/node/node.h>

#include "apps/config/key_change.h"
#include "apps/config/map_file.h"

/// Reads YAML strictly: no error is ignored, and all errors of a file are reported together.
namespace twocone::config {

struct Unit {
  std::string_view symbol;  ///< follows a value: "m"
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
  bool without_ends = false;  ///< the two ends are excluded
  std::string_view words{};   ///< text of the rule in a message; empty: made from the numbers
};
inline constexpr Range kAnyNumber{};
inline constexpr Range kAboveZero{.least = 0, .without_ends = true};
inline constexpr Range kZeroOrMore{.least = 0};
/// The range is wide, because an angle may be given as 3/4 or as -1/4 of a turn. Most values in degrees are rejected.
inline constexpr Range kWithinATurn{
    .least = -2 * std::numbers::pi, .greatest = 2 * std::numbers::pi, .words = "-2 pi to 2 pi"};
/// Lengths of small parts (wheels, mirrors) and of the whole robot. A larger robot does not fit through a door. A value
/// of 60 is probably 60 mm or 60 cm, written as metres.
inline constexpr Range kPartLength{.least = 0, .greatest = 1, .without_ends = true};
inline constexpr Range kRobotLength{.least = 0, .greatest = 5, .without_ends = true};

/// Returns whether `name` is not empty and consists of a-z, A-Z, 0-9 and `further`.
[[nodiscard]] bool is_name(std::string_view name, std::string_view further);

/// The meaning and the allowed range of a number. `what` completes the message "is missing: ".
struct Quantity {
  std::string_view what;
  Unit unit;
  Range range;
};

enum class Need { kRequired, kOptional };

class Reading;

/// One mapping of the file. Each method that reads a key marks it as known. It returns true if `value` now holds a
/// valid value: the one in the file or, for an absent optional key, the previous one. Otherwise it has added a
/// complaint.
/// @throws only std::bad_alloc; Reading::finish() throws all complaints together
class Section {
 public:
  bool number(std::string_view key, const Quantity& quantity, double& value, Need need = Need::kRequired);
  /// Reads an optional number.
  bool number(std::string_view key, const Quantity& quantity, std::optional<double>& value);
  /// Reads a whole number within the range of `quantity`.
  bool whole(std::string_view key, const Quantity& quantity, int& value, Need need = Need::kRequired);
  bool whole(std::string_view key, const Quantity& quantity, std::optional<int>& value);
  /// Reads text that is not empty. A number counts as text.
  bool text(std::string_view key, std::string_view what, std::string& value, Need need = Need::kRequired);
  /// Reads true or false.
  bool flag(std::string_view key, std::string_view what, bool& value, Need need = Need::kRequired);
  /// Reads a list of exactly values.size() numbers.
  bool numbers(std::string_view key, const Quantity& quantity, std::span<double> values, Need need = Need::kRequired);
  /// Reads a number, which sets all values, or a list of values.size() numbers.
  bool number_or_list(std::string_view key, const Quantity& quantity, std::span<double> values,
                      Need need = Need::kRequired);
  /// Reads a list whose length is one of `counts`.
  bool number_list(std::string_view key, const Quantity& quantity, std::span<const std::size_t> counts,
                   std::vector<double>& values, Need need = Need::kRequired);
  /// Reads a list of texts, none of them empty.
  bool texts(std::string_view key, std::string_view what, std::vector<std::string>& values,
             Need need = Need::kRequired);
  /// Reads a list of [x, y].
  bool points(std::string_view key, std::string_view what, std::vector<Point>& values, Need need = Need::kRequired);
  /// Returns a mapping, or null if there is none.
  Section* section(std::string_view key, std::string_view what, Need need = Need::kRequired);
  /// Returns a list of mappings. It complains about items that are not mappings and leaves them out.
  std::vector<Section*> sections(std::string_view key, std::string_view what, Need need = Need::kRequired);

  /// Returns all keys in the file's order, for mappings that use names as keys.
  [[nodiscard]] std::vector<std::string> keys() const;
  /// Returns whether the key is present, and marks it as known.
  bool has(std::string_view key);
  /// Returns whether the key is present with a number as its value, and marks it as known.
  bool has_number(std::string_view key);
  void complain_missing(std::string_view key, std::string_view what, Unit unit = kNoUnit);
  /// Adds "PATH.KEY is VALUE UNIT, must be RULE" at the key's line.
  void complain(std::string_view key, Unit unit, std::string_view rule);
  /// Adds "PATH TEXT", a complaint about the mapping itself.
  void complain_here(std::string_view text);

 private:
  friend class Reading;
  /// A value and its place in the file.
  struct Item {
    YAML::Node node;
    int line;  ///< of the value or of its key, from 1; 0: unknown
    std::string path;
  };
  struct Entry {
    std::string key;
    Item item;  ///< with the key's line
    bool asked;
  };

  Section(Reading& reading, const Item& mapping);
  Entry* find(std::string_view key);
  /// Returns the value of a key, or null. Complains if it is missing and required.
  const Item* find(std::string_view key, std::string_view what, Unit unit, Need need);
  [[nodiscard]] std::string path_of(std::string_view key) const;
  static std::vector<Item> items_of(const Item& list);
  /// Adds a complaint, and returns false.
  bool refuse(const Item& item, Unit unit, std::string_view rule);
  bool take_number(const Item& item, const Quantity& quantity, double& value);
  Section* add_section(const Item& mapping);
  void complain_unknown() const;

  Reading* reading_;
  std::string path_;  ///< "" for the file itself
  int line_;
  std::vector<Entry> entries_;
  std::vector<std::string> known_;
};

/// Reads one file. It owns the sections and collects all complaints about them.
class Reading {
 public:
  /// @param file named in messages
  /// @param changes already made to `root`; messages about their keys name the change instead of the line
  Reading(const YAML::Node& root, const std::filesystem::path& file, const std::vector<KeyChange>& changes = {});
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// Returns the outermost mapping. @throws FileError if there is none
  Section& root();

  /// @throws FileError with all complaints, sorted by line, also those about keys that no method has read
  void finish();

 private:
  friend class Section;
  struct Complaint {
    int line;
    std::string text;
  };
  /// Returns where the cause of a complaint is: FILE:LINE, FILE, or --set KEY=VALUE.
  [[nodiscard]] std::string place_of(const Complaint& complaint) const;
  /// Adds a complaint once, since two parts may share the same text.
  void complain(int line, std::string text);

  std::string file_;
  std::vector<KeyChange> changes_;
  YAML::Node node_;
  std::deque<Section> sections_;  ///< a deque keeps the addresses of the sections valid
  std::vector<Complaint> complaints_;
};

/// Returns the only document of a YAML text. @param file named in messages
/// @throws FileError: FILE:LINE:COLUMN for a syntax error; an empty text; several documents
YAML::Node parse_yaml(const std::string& text, const std::filesystem::path& file);
/// Returns the only document of a YAML file. @throws FileError as parse_yaml and read_text
YAML::Node load_yaml(const std::filesystem::path& file);

}  // namespace twocone::config
