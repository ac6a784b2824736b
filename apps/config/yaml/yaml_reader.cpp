// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"

namespace twocone::config {
namespace {

constexpr std::size_t kLongestShown = 60;  ///< bytes of a value in a message, which must stay on one line

int line_of(const YAML::Node& node, int otherwise) {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? otherwise : mark.line + 1;
}

/// Returns `text` as part of one line, with control characters escaped.
std::string on_one_line(std::string_view text) {
  std::string shown;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      shown += fmt::format("\\x{:02x}", byte);
    } else {
      shown += c;
    }
  }
  return shown;
}

/// Returns text of a file for a message: on one line, and shortened if it is long, but not inside a UTF-8 character.
std::string printable(std::string_view text) {
  if (text.size() <= kLongestShown) return on_one_line(text);
  std::size_t end = kLongestShown;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return on_one_line(text.substr(0, end)) + "...";
}

/// Returns whether the node is a plain scalar. A quoted scalar is always text.
bool is_plain(const YAML::Node& node) { return node.IsScalar() && node.Tag() != "!"; }

bool is_text(const YAML::Node& node) { return node.IsScalar() && !node.Scalar().empty(); }

/// Returns a number as JSON and YAML write it, including infinity and NaN, or nothing for other text. The conversion of
/// yaml-cpp is not used, because it reads 010 as eight.
std::optional<double> number_in(const YAML::Node& node) {
  if (!is_plain(node)) return std::nullopt;
  const std::string& text = node.Scalar();
  std::string_view digits = text;
  if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);
  const std::string_view unsigned_part = digits.starts_with('-') ? digits.substr(1) : digits;
  for (const std::string_view name : {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN"}) {
    if (unsigned_part == name) return std::numeric_limits<double>::quiet_NaN();  // always rejected, whatever its sign
  }
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (end != digits.data() + digits.size() || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::quiet_NaN();
  return value;
}

std::string show_scalar(const YAML::Node& node) {
  if (node.IsNull()) return "empty";
  if (node.IsSequence()) return fmt::format("a list of {}", node.size());
  if (node.IsMap()) return "a mapping";
  return number_in(node) ? printable(node.Scalar()) : fmt::format("'{}'", printable(node.Scalar()));
}

/// Returns a value for a message: numbers with their unit, text in quotes, longer values by their kind.
std::string show(const YAML::Node& node, Unit unit) {
  constexpr std::size_t kLongestListShown = 4;
  std::string shown = show_scalar(node);
  bool is_numeric = number_in(node).has_value();
  if (node.IsSequence() && node.size() > 0 && node.size() <= kLongestListShown &&
      std::all_of(node.begin(), node.end(), [](const auto& item) { return item.IsScalar(); })) {
    std::vector<std::string> items;
    for (const auto& item : node) items.push_back(show_scalar(item));
    shown = fmt::format("[{}]", fmt::join(items, ", "));
    is_numeric = true;
  }
  return is_numeric && !unit.symbol.empty() ? fmt::format("{} {}", shown, unit.symbol) : shown;
}

/// Returns for example "a number (metres)".
std::string with_unit(std::string_view kind, Unit unit) {
  return unit.name.empty() ? std::string(kind) : fmt::format("{} ({})", kind, unit.name);
}

std::string in_words(const Range& range) {
  if (!range.words.empty()) return std::string(range.words);
  const bool has_least = std::isfinite(range.least);
  const bool has_greatest = std::isfinite(range.greatest);
  if (has_least && has_greatest && !range.without_ends) return fmt::format("{} to {}", range.least, range.greatest);
  const std::string_view equal = range.without_ends ? "" : "=";
  if (has_least && has_greatest) return fmt::format("> {} and < {}", range.least, range.greatest);
  if (has_least) return fmt::format(">{} {}", equal, range.least);
  if (has_greatest) return fmt::format("<{} {}", equal, range.greatest);
  return "a finite number";
}

bool is_in(const Range& range, double value) {
  return range.without_ends ? range.least < value && value < range.greatest
                            : range.least <= value && value <= range.greatest;
}

/// Returns the first line that is indented by a tab, from 1, or 0. A tab is text inside a block scalar, so the result
/// only explains a syntax error.
int tab_indented_line(std::string_view text) {
  int line = 1;
  bool in_indent = true;
  for (const char c : text) {
    if (in_indent && c == '\t') return line;
    if (c == '\n') ++line;
    in_indent = c == '\n' || (in_indent && c == ' ');
  }
  return 0;
}

/// Parses documents without storing them.
class IgnoreEvents final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

}  // namespace

bool is_name(std::string_view name, std::string_view further) {
  const auto is_allowed = [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           further.find(c) != std::string_view::npos;
  };
  return !name.empty() && std::ranges::all_of(name, is_allowed);
}

Section::Section(Reading& reading, const Item& mapping) : reading_(&reading), path_(mapping.path), line_(mapping.line) {
  for (const auto& pair : mapping.node) {
    const YAML::Node& key = pair.first;
    const int line = line_of(key, line_);
    if (!key.IsScalar()) {
      reading_->complain(line, fmt::format("{} has {} as a key, must be a word", path_.empty() ? "the file" : path_,
                                           show_scalar(key)));
      continue;
    }
    const std::string& name = key.Scalar();
    const auto earlier = std::ranges::find(entries_, name, &Entry::key);
    if (earlier != entries_.end()) {
      reading_->complain(
          line, fmt::format("{} is given twice, the first time in line {}", path_of(name), earlier->item.line));
      continue;
    }
    entries_.push_back({name, {pair.second, line, path_of(name)}, false});
  }
}

std::string Section::path_of(std::string_view key) const {
  return path_.empty() ? printable(key) : fmt::format("{}.{}", path_, printable(key));
}

Section::Entry* Section::find(std::string_view key) {
  if (std::ranges::find(known_, key) == known_.end()) known_.emplace_back(key);
  const auto entry = std::ranges::find(entries_, key, &Entry::key);
  if (entry == entries_.end()) return nullptr;
  entry->asked = true;
  return &*entry;
}

const Section::Item* Section::find(std::string_view key, std::string_view what, Unit unit, Need need) {
  const Entry* const entry = find(key);
  if (entry != nullptr) return &entry->item;
  if (need == Need::kRequired) complain_missing(key, what, unit);
  return nullptr;
}

bool Section::has(std::string_view key) { return find(key) != nullptr; }

bool Section::has_number(std::string_view key) {
  const Entry* const entry = find(key);
  return entry != nullptr && number_in(entry->item.node);
}

void Section::complain_missing(std::string_view key, std::string_view what, Unit unit) {
  reading_->complain(
      line_, fmt::format("{} is missing: {}{}{}", path_of(key), what, unit.name.empty() ? "" : ", ", unit.name));
}

void Section::complain(std::string_view key, Unit unit, std::string_view rule) {
  const Entry* const entry = find(key);
  refuse(entry != nullptr ? entry->item : Item{{}, line_, path_of(key)}, unit, rule);
}

void Section::complain_here(std::string_view text) { reading_->complain(line_, fmt::format("{} {}", path_, text)); }

bool Section::refuse(const Item& item, Unit unit, std::string_view rule) {
  reading_->complain(item.line, fmt::format("{} is {}, must be {}", item.path, show(item.node, unit), rule));
  return false;
}

std::vector<Section::Item> Section::items_of(const Item& list) {
  std::vector<Item> items;
  if (!list.node.IsSequence()) return items;
  for (const auto& node : list.node) {
    items.push_back({node, line_of(node, list.line), fmt::format("{}[{}]", list.path, items.size())});
  }
  return items;
}

bool Section::take_number(const Item& item, const Quantity& quantity, double& value) {
  const std::optional<double> number = number_in(item.node);
  if (!number) return refuse(item, quantity.unit, with_unit("a number", quantity.unit));
  if (!std::isfinite(*number)) return refuse(item, quantity.unit, with_unit("a finite number", quantity.unit));
  if (!is_in(quantity.range, *number)) return refuse(item, quantity.unit, in_words(quantity.range));
  value = *number;
  return true;
}

std::vector<std::string> Section::keys() const {
  std::vector<std::string> keys;
  for (const Entry& entry : entries_) keys.push_back(entry.key);
  return keys;
}

bool Section::number(std::string_view key, const Quantity& quantity, double& value, Need need) {
  const Item* const item = find(key, quantity.what, quantity.unit, need);
  return item == nullptr ? need == Need::kOptional : take_number(*item, quantity, value);
}

bool Section::number(std::string_view key, const Quantity& quantity, std::optional<double>& value) {
  double number = 0;
  const bool good = this->number(key, quantity, number, Need::kOptional);
  if (good && has(key)) value = number;
  return good;
}

bool Section::whole(std::string_view key, const Quantity& quantity, int& value, Need need) {
  double number = value;
  if (!this->number(key, quantity, number, need)) return false;
  if (number != std::trunc(number)) return complain(key, quantity.unit, "a whole number"), false;
  if (std::abs(number) > std::numeric_limits<int>::max()) {
    return complain(key, quantity.unit, fmt::format("at most {}", std::numeric_limits<int>::max())), false;
  }
  value = static_cast<int>(number);
  return true;
}

bool Section::whole(std::string_view key, const Quantity& quantity, std::optional<int>& value) {
  int number = 0;
  const bool good = whole(key, quantity, number, Need::kOptional);
  if (good && has(key)) value = number;
  return good;
}

bool Section::text(std::string_view key, std::string_view what, std::string& value, Need need) {
  const Item* const item = find(key, what, kNoUnit, need);
  if (item == nullptr) return need == Need::kOptional;
  if (!is_text(item->node)) return refuse(*item, kNoUnit, "text that is not empty");
  value = item->node.Scalar();
  return true;
}

bool Section::flag(std::string_view key, std::string_view what, bool& value, Need need) {
  const Item* const item = find(key, what, kNoUnit, need);
  if (item == nullptr) return need == Need::kOptional;
  const std::string text = is_plain(item->node) ? item->node.Scalar() : "";
  if (text != "true" && text != "false") return refuse(*item, kNoUnit, "true or false");
  value = text == "true";
  return true;
}

bool Section::numbers(std::string_view key, const Quantity& quantity, std::span<double> values, Need need) {
  const Item* const list = find(key, quantity.what, quantity.unit, need);
  if (list == nullptr) return need == Need::kOptional;
  if (!list->node.IsSequence() || list->node.size() != values.size()) {
    return refuse(*list, quantity.unit, with_unit(fmt::format("a list of {} numbers", values.size()), quantity.unit));
  }
  bool good = true;
  double* value = values.data();
  for (const Item& item : items_of(*list)) good &= take_number(item, quantity, *value++);
  return good;
}

bool Section::number_or_list(std::string_view key, const Quantity& quantity, std::span<double> values, Need need) {
  const Item* const item = find(key, quantity.what, quantity.unit, need);
  if (item == nullptr) return need == Need::kOptional;
  if (item->node.IsSequence()) return numbers(key, quantity, values, need);
  if (!number_in(item->node)) {
    const std::string rule = fmt::format("a number or a list of {} numbers", values.size());
    return refuse(*item, quantity.unit, with_unit(rule, quantity.unit));
  }
  if (!take_number(*item, quantity, values[0])) return false;
  std::ranges::fill(values, values[0]);
  return true;
}

bool Section::number_list(std::string_view key, const Quantity& quantity, std::span<const std::size_t> counts,
                          std::vector<double>& values, Need need) {
  const Item* const item = find(key, quantity.what, quantity.unit, need);
  if (item == nullptr) return need == Need::kOptional;
  const std::size_t count = item->node.IsSequence() ? item->node.size() : std::numeric_limits<std::size_t>::max();
  if (std::ranges::find(counts, count) == counts.end()) {
    const std::string rule = fmt::format("a list of {} numbers", fmt::join(counts, " or "));
    return refuse(*item, quantity.unit, with_unit(rule, quantity.unit));
  }
  std::vector<double> list(count);
  if (!numbers(key, quantity, list, need)) return false;
  values = std::move(list);
  return true;
}

bool Section::texts(std::string_view key, std::string_view what, std::vector<std::string>& values, Need need) {
  const Item* const list = find(key, what, kNoUnit, need);
  if (list == nullptr) return need == Need::kOptional;
  if (!list->node.IsSequence()) return refuse(*list, kNoUnit, "a list of texts");
  std::vector<std::string> texts;
  bool good = true;
  for (const Item& item : items_of(*list)) {
    good &= is_text(item.node) || refuse(item, kNoUnit, "text that is not empty");
    if (good) texts.push_back(item.node.Scalar());
  }
  if (good) values = std::move(texts);
  return good;
}

bool Section::points(std::string_view key, std::string_view what, std::vector<Point>& values, Need need) {
  const Item* const list = find(key, what, kMetres, need);
  if (list == nullptr) return need == Need::kOptional;
  if (!list->node.IsSequence()) return refuse(*list, kMetres, "a list of [x, y] (metres)");
  const Quantity quantity{what, kMetres, kAnyNumber};
  std::vector<Point> points;
  bool good = true;
  for (const Item& item : items_of(*list)) {
    const std::vector<Item> pair = items_of(item);
    if (pair.size() != 2) {
      good = refuse(item, kMetres, "[x, y] (metres)");
      continue;
    }
    Point& point = points.emplace_back();
    good &= take_number(pair[0], quantity, point.x_m);
    good &= take_number(pair[1], quantity, point.y_m);
  }
  if (good) values = std::move(points);
  return good;
}

Section* Section::add_section(const Item& mapping) {
  if (!mapping.node.IsMap()) return refuse(mapping, kNoUnit, "a mapping"), nullptr;
  reading_->sections_.push_back(Section(*reading_, mapping));
  return &reading_->sections_.back();
}

Section* Section::section(std::string_view key, std::string_view what, Need need) {
  const Item* const item = find(key, what, kNoUnit, need);
  return item == nullptr ? nullptr : add_section(*item);
}

std::vector<Section*> Section::sections(std::string_view key, std::string_view what, Need need) {
  std::vector<Section*> found;
  const Item* const list = find(key, what, kNoUnit, need);
  if (list == nullptr) return found;
  if (!list->node.IsSequence()) refuse(*list, kNoUnit, "a list of mappings");
  for (const Item& item : items_of(*list)) {
    if (Section* const section = add_section(item)) found.push_back(section);
  }
  return found;
}

void Section::complain_unknown() const {
  for (const Entry& entry : entries_) {
    if (entry.asked) continue;
    const std::optional<std::string> meant = nearest(entry.key, known_);
    reading_->complain(entry.item.line, fmt::format("{} is unknown{} (known here: {})", entry.item.path,
                                                    meant ? fmt::format(", did you mean {}?", *meant) : std::string(),
                                                    fmt::join(known_, ", ")));
  }
}

Reading::Reading(const YAML::Node& root, const std::filesystem::path& file, const std::vector<KeyChange>& changes)
    : file_(file.string()), changes_(changes), node_(root) {}

std::string Reading::place_of(const Complaint& complaint) const {
  // Each text begins with the path of a key.
  const std::string_view path = std::string_view(complaint.text).substr(0, complaint.text.find(' '));
  const auto is_within = [](std::string_view inner, std::string_view outer) {
    return inner == outer || (inner.starts_with(outer) && (inner[outer.size()] == '.' || inner[outer.size()] == '['));
  };
  for (const KeyChange& change : changes_) {
    // A section that a change has added is in no line.
    const bool is_added = complaint.line == 0 && is_within(change.key, path);
    if (is_added || is_within(path, change.key)) return "--set " + to_string(change);
  }
  return complaint.line > 0 ? fmt::format("{}:{}", file_, complaint.line) : file_;
}

void Reading::complain(int line, std::string text) {
  const bool is_reported =
      std::ranges::any_of(complaints_, [&](const Complaint& c) { return c.line == line && c.text == text; });
  if (!is_reported) complaints_.push_back({line, std::move(text)});
}

Section& Reading::root() {
  if (!node_.IsDefined()) throw FileError("{}: the mapping to be read is missing", file_);
  const int line = line_of(node_, 0);
  if (!node_.IsMap()) {
    complain(line, fmt::format("the file is {}, must be a mapping of keys", show(node_, kNoUnit)));
    finish();
  }
  sections_.push_back(Section(*this, {node_, line, ""}));
  return sections_.back();
}

void Reading::finish() {
  for (const Section& section : sections_) section.complain_unknown();
  if (complaints_.empty()) return;
  std::ranges::stable_sort(complaints_, {}, &Complaint::line);
  std::vector<std::string> lines;
  for (const Complaint& complaint : complaints_) {
    lines.push_back(fmt::format("{}: {}", place_of(complaint), complaint.text));
  }
  throw FileError("{}", fmt::join(lines, "\n"));
}

YAML::Node parse_yaml(const std::string& text, const std::filesystem::path& file) {
  YAML::Node document;
  bool has_first = false;
  bool has_second = false;
  try {
    // LoadAll is not used: for a file that begins with a comma it loads empty documents until the memory is full.
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    IgnoreEvents ignored;
    has_first = parser.HandleNextDocument(ignored);
    has_second = has_first && parser.HandleNextDocument(ignored);
    document = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    const int last_line = error.mark.is_null() ? std::numeric_limits<int>::max() : error.mark.line + 1;
    if (const int line = tab_indented_line(text); line > 0 && line <= last_line) {
      throw FileError("{}:{}: the line is indented by a tab, must be by spaces", file.string(), line);
    }
    const std::string why = on_one_line(error.msg);  // the message may quote the file
    if (error.mark.is_null()) throw FileError("{}: {}", file.string(), why);
    throw FileError("{}:{}:{}: {}", file.string(), error.mark.line + 1, error.mark.column + 1, why);
  }
  if (!has_first || (!has_second && document.IsNull())) {
    throw FileError("{}: is empty, must be a mapping of keys", file.string());
  }
  if (has_second) throw FileError("{}: holds several YAML documents, must be one", file.string());
  return document;
}

YAML::Node load_yaml(const std::filesystem::path& file) { return parse_yaml(read_text(file), file); }

}  // namespace twocone::config
