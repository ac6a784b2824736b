// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/tables.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <nlohmann/json.hpp>

#include "apps/runlog/storage/disk.h"

namespace twocone::runlog {
namespace {

constexpr char kBetween = ';';

template <typename Row>
struct Columns;

// Lists the columns of a table once, in the order of the row's members, for the header, writing and reading.
#define TWOCONE_COLUMNS(Row, ...)                      \
  template <>                                          \
  struct Columns<Row> {                                \
    static constexpr const char* names = #__VA_ARGS__; \
    static auto of(auto& row) {                        \
      auto& [__VA_ARGS__] = row;                       \
      return std::tie(__VA_ARGS__);                    \
    }                                                  \
  }
TWOCONE_COLUMNS(FrameRow, frame, t_s, skew_s, lower_t_s, upper_t_s, lower_sequence, upper_sequence, lower_lost,
                upper_lost, host_t_s);
TWOCONE_COLUMNS(DriveRow, t_s, left_command_radps, right_command_radps, left_rad, right_rad);
TWOCONE_COLUMNS(RangeRow, frame, t_s, landmark, verdict, range_m, sigma_range_m, bearing_rad, sigma_bearing_rad,
                disparity_px, true_range_m);
TWOCONE_COLUMNS(FixRow, frame, t_s, verdict, x_m, y_m, heading_rad, var_x_m2, cov_xy_m2, var_y_m2, var_heading_rad2,
                true_x_m, true_y_m, error_m, outliers, cov_x_heading_m_rad, cov_y_heading_m_rad, unseen_x, unseen_y,
                unseen_heading, own_var_x_m2, own_cov_xy_m2, own_var_y_m2, own_var_heading_rad2);
TWOCONE_COLUMNS(SightingRow, frame, t_s, landmark, view, column_px, row_px, var_column_px2, cov_px2, var_row_px2,
                edge_noise_px);
TWOCONE_COLUMNS(LandmarkRow, frame, t_s, landmark, x_m, y_m, top_m, radius_m, var_x_m2, cov_xy_m2, var_y_m2,
                sigma_top_m, sigma_radius_m, sightings);
TWOCONE_COLUMNS(TimingRow, frame, t_s, vision_s, localisation_s, wall_s, refined, verdict);
TWOCONE_COLUMNS(TrackRow, frame, t_s, state, x_m, y_m, heading_rad, var_x_m2, cov_xy_m2, var_y_m2, cov_x_heading_m_rad,
                cov_y_heading_m_rad, var_heading_rad2, fix, use, plan);
TWOCONE_COLUMNS(ScanRow, frame, t_s, beam_rad, state, range_m, sigma_m);
#undef TWOCONE_COLUMNS

/// Returns whether tables of older versions lack that many of the last columns.
template <typename Row>
bool is_older(std::size_t missing) {
  if (std::is_same_v<Row, TrackRow>) return missing == 1;
  return std::is_same_v<Row, FixRow> && (missing == 4 || missing == 9 || missing == 10);
}

/// Rounds a heading to 1e-9 rad, both when it is written and when it is read. It then survives the twelve digits of a
/// quaternion unchanged, so results computed from a stored run equal those computed during the run.
double nanoradians(double heading_rad) {
  constexpr double kMost_rad = 3.141592653;  // the largest multiple of 1e-9 below pi
  return std::clamp(std::round(heading_rad * 1e9) / 1e9, -kMost_rad, kMost_rad);
}

}  // namespace

std::string to_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}
std::string to_field(const std::optional<double>& value) { return value ? to_field(*value) : std::string(); }
std::string to_field(const std::optional<bool>& value) { return value ? to_field(int(*value)) : std::string(); }
std::string to_field(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += kBetween;
    for (const char c : names[i]) {
      if (c == kBetween || c == '\\') text += '\\';
      text += c;
    }
  }
  return to_field(text);
}

std::vector<std::string> split_fields(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

bool parse_field(const std::string& field, std::string& value) {
  value = field;
  return true;
}
bool parse_field(const std::string& field, std::optional<double>& value) {
  double number = 0;
  if (!field.empty() && !parse_field(field, number)) return false;
  value = field.empty() ? std::nullopt : std::optional(number);
  return true;
}
bool parse_field(const std::string& field, std::optional<bool>& value) {
  if (!field.empty() && field != "0" && field != "1") return false;
  value = field.empty() ? std::nullopt : std::optional(field == "1");
  return true;
}
bool parse_field(const std::string& field, std::vector<std::string>& names) {
  std::vector<std::string> read;
  if (!field.empty()) read.emplace_back();
  for (std::size_t i = 0; i < field.size(); ++i) {
    if (field[i] == '\\') {
      if (++i == field.size()) return false;
      read.back() += field[i];
    } else if (field[i] == kBetween) {
      read.emplace_back();
    } else {
      read.back() += field[i];
    }
  }
  names = std::move(read);
  return true;
}

template <typename Row>
std::string TableReader<Row>::header() {
  std::string header = Columns<Row>::names;
  std::erase(header, ' ');
  return header;
}

template <typename Row>
std::string TableReader<Row>::line(const Row& row) {
  return join_fields(Columns<Row>::of(row));
}

template <typename Row>
TableReader<Row>::TableReader(const std::filesystem::path& file) : file_(file) {
  if (!std::filesystem::exists(file)) return;
  lines_.emplace(file);
  const auto first = lines_->next();
  if (!first) {
    lines_.reset();
    return;
  }
  const std::string all = header();
  if (*first == all) return;
  if (all.starts_with(*first + ','))
    missing_ = std::size_t(std::count(all.begin() + std::ssize(*first), all.end(), ','));
  if (!is_older<Row>(missing_)) config::refuse_line(file, 1, "the first line must be {}", all);
}

template <typename Row>
std::optional<Row> TableReader<Row>::next() {
  const auto line = lines_ ? lines_->next() : std::nullopt;
  if (!line) return std::nullopt;
  auto fields = split_fields(*line);
  Row row;
  auto columns = Columns<Row>::of(row);
  constexpr std::size_t kCount = std::tuple_size_v<decltype(columns)>;
  const std::size_t count = kCount - missing_;
  if (fields.size() != count)
    config::refuse_line(file_, lines_->number(), "has {} fields, must have {}", fields.size(), count);
  fields.resize(kCount);
  std::size_t at = 0;
  std::apply(
      [&](auto&... column) {
        const auto take = [&](auto& value) {
          if (!parse_field(fields[at], value)) {
            config::refuse_line(file_, lines_->number(), "field {} is '{}', must be a number", at + 1, fields[at]);
          }
          ++at;
        };
        (take(column), ...);
      },
      columns);
  return row;
}

namespace {

bool is_given(const auto& /*value*/) { return true; }
bool is_given(const std::string& text) { return !text.empty(); }
bool is_given(const std::optional<double>& number) { return number && std::isfinite(*number); }
bool is_given(const std::vector<std::string>& names) { return !names.empty(); }

const auto& content_of(const auto& value) { return value; }
double content_of(const std::optional<double>& number) { return *number; }

/// Calls f(name, value) for each column.
template <typename Row, typename F>
void for_columns(const Row& row, const F& f) {
  const std::vector<std::string> names = split_fields(TableReader<Row>::header());
  std::apply(
      [&](const auto&... column) {
        auto name = names.begin();
        (f(*name++, column), ...);
      },
      Columns<Row>::of(row));
}

}  // namespace

template <typename Row>
nlohmann::ordered_json to_object(const Row& row) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  for_columns(row, [&](const std::string& name, const auto& value) {
    if (is_given(value)) object[name] = content_of(value);
  });
  return object;
}

template <typename Row>
std::set<std::string> text_columns() {
  std::set<std::string> names;
  for_columns(Row(), [&]<typename Value>(const std::string& name, const Value& /*value*/) {
    if constexpr (std::is_same_v<Value, std::string> || std::is_same_v<Value, std::vector<std::string>>) {
      names.insert(name);
    }
  });
  return names;
}

#define TWOCONE_TABLE(Row)                            \
  template class TableReader<Row>;                    \
  template std::set<std::string> text_columns<Row>(); \
  template nlohmann::ordered_json to_object(const Row& row)
TWOCONE_TABLE(FrameRow);
TWOCONE_TABLE(DriveRow);
TWOCONE_TABLE(RangeRow);
TWOCONE_TABLE(FixRow);
TWOCONE_TABLE(SightingRow);
TWOCONE_TABLE(LandmarkRow);
TWOCONE_TABLE(TimingRow);
TWOCONE_TABLE(TrackRow);
TWOCONE_TABLE(ScanRow);
#undef TWOCONE_TABLE

std::string to_line(const TrackRow& row) {
  TrackRow kept = row;
  if (kept.heading_rad) kept.heading_rad = nanoradians(*kept.heading_rad);
  return TableReader<TrackRow>::line(kept);
}
std::string to_line(const PoseRow& row) {
  const double half_rad = nanoradians(row.heading_rad) / 2;
  return fmt::format("{} {} {} 0 0 0 {:.12f} {:.12f}", row.t_s, row.x_m, row.y_m, std::sin(half_rad),
                     std::cos(half_rad));
}

std::vector<PoseRow> read_poses(const std::filesystem::path& file) {
  std::vector<PoseRow> rows;
  if (!std::filesystem::exists(file)) return rows;
  config::TextLines lines(file);
  while (const auto line = lines.next()) {
    if (line->empty() || (*line)[0] == '#') continue;
    std::vector<double> v;
    for (std::size_t begin = 0; begin < line->size();) {
      const std::size_t end = std::min(line->find(' ', begin), line->size());
      if (end > begin && !parse_field(line->substr(begin, end - begin), v.emplace_back())) {
        config::refuse_line(file, lines.number(), "'{}' is no number", line->substr(begin, end - begin));
      }
      begin = end + 1;
    }
    if (v.size() != 8)
      config::refuse_line(file, lines.number(), "has {} numbers, must have 8: t tx ty tz qx qy qz qw", v.size());
    // The rotation may also have a small roll and pitch. The heading is the angle about z.
    const double heading = std::atan2(2 * (v[7] * v[6] + v[4] * v[5]), 1 - 2 * (v[5] * v[5] + v[6] * v[6]));
    rows.push_back({v[0], v[1], v[2], nanoradians(heading)});
  }
  return rows;
}

}  // namespace twocone::runlog
