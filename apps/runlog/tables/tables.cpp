// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/tables/csv_fields.h"

namespace twocone::runlog {
namespace {

// One list of columns for each table serves the header, writing and reading.
template <typename Row>
struct Columns;

template <>
struct Columns<FrameRow> {
  static constexpr const char* header =
      "frame,t_s,skew_s,lower_t_s,upper_t_s,lower_sequence,upper_sequence,lower_lost,upper_lost,host_t_s";
  static auto of(auto& r) {
    return std::tie(r.frame, r.t_s, r.skew_s, r.lower_t_s, r.upper_t_s, r.lower_sequence, r.upper_sequence,
                    r.lower_lost, r.upper_lost, r.host_t_s);
  }
};
template <>
struct Columns<DriveRow> {
  static constexpr const char* header = "t_s,left_command_radps,right_command_radps,left_rad,right_rad";
  static auto of(auto& r) {
    return std::tie(r.t_s, r.left_command_radps, r.right_command_radps, r.left_rad, r.right_rad);
  }
};
template <>
struct Columns<RangeRow> {
  static constexpr const char* header =
      "frame,t_s,landmark,verdict,range_m,sigma_range_m,bearing_rad,sigma_bearing_rad,disparity_px,true_range_m";
  static auto of(auto& r) {
    return std::tie(r.frame, r.t_s, r.landmark, r.verdict, r.range_m, r.sigma_range_m, r.bearing_rad,
                    r.sigma_bearing_rad, r.disparity_px, r.true_range_m);
  }
};
template <>
struct Columns<FixRow> {
  static constexpr const char* header =
      "frame,t_s,verdict,x_m,y_m,heading_rad,var_x_m2,cov_xy_m2,var_y_m2,var_heading_rad2,true_x_m,true_y_m,error_m,"
      "outliers,cov_x_heading_m_rad,cov_y_heading_m_rad,unseen_x,unseen_y,unseen_heading";
  /// Last columns that tables of older versions lack.
  static constexpr std::array<std::string_view, 2> added = {
      ",cov_x_heading_m_rad,cov_y_heading_m_rad,unseen_x,unseen_y,unseen_heading",
      ",outliers,cov_x_heading_m_rad,cov_y_heading_m_rad,unseen_x,unseen_y,unseen_heading"};
  static auto of(auto& r) {
    return std::tie(r.frame, r.t_s, r.verdict, r.x_m, r.y_m, r.heading_rad, r.var_x_m2, r.cov_xy_m2, r.var_y_m2,
                    r.var_heading_rad2, r.true_x_m, r.true_y_m, r.error_m, r.outliers, r.cov_x_heading_m_rad,
                    r.cov_y_heading_m_rad, r.unseen_x, r.unseen_y, r.unseen_heading);
  }
};
template <>
struct Columns<SightingRow> {
  static constexpr const char* header =
      "frame,t_s,landmark,view,column_px,row_px,var_column_px2,cov_px2,var_row_px2,edge_noise_px";
  static auto of(auto& r) {
    return std::tie(r.frame, r.t_s, r.landmark, r.view, r.column_px, r.row_px, r.var_column_px2, r.cov_px2,
                    r.var_row_px2, r.edge_noise_px);
  }
};
template <>
struct Columns<TimingRow> {
  static constexpr const char* header = "frame,t_s,vision_s,localisation_s,wall_s,refined,verdict";
  static auto of(auto& r) {
    return std::tie(r.frame, r.t_s, r.vision_s, r.localisation_s, r.wall_s, r.refined, r.verdict);
  }
};
template <>
struct Columns<TrackRow> {
  static constexpr const char* header =
      "frame,t_s,state,x_m,y_m,heading_rad,var_x_m2,cov_xy_m2,var_y_m2,cov_x_heading_m_rad,cov_y_heading_m_rad,"
      "var_heading_rad2,fix,use";
  static auto of(auto& r) {
    return std::tie(r.frame, r.t_s, r.state, r.x_m, r.y_m, r.heading_rad, r.var_x_m2, r.cov_xy_m2, r.var_y_m2,
                    r.cov_x_heading_m_rad, r.cov_y_heading_m_rad, r.var_heading_rad2, r.fix, r.use);
  }
};

template <typename Row>
concept Grown = requires {
  Columns<Row>::added;
};

/// Rounds a heading to 1e-9 rad, both when it is written and when it is read. It then survives the twelve digits of a
/// quaternion unchanged, so results computed from a stored run equal those computed during the run.
double nanoradians(double heading_rad) {
  constexpr double kMost_rad = 3.141592653;  // the largest multiple of 1e-9 below pi
  return std::clamp(std::round(heading_rad * 1e9) / 1e9, -kMost_rad, kMost_rad);
}

[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t line, const std::string& what) {
  throw config::FileError(fmt::format("{}:{}: {}", file.string(), line, what));
}

template <typename Row>
std::string line_of(const Row& row) {
  return join_fields(Columns<Row>::of(row));
}

}  // namespace

template <typename Row>
std::string TableReader<Row>::header() {
  return Columns<Row>::header;
}

template <typename Row>
TableReader<Row>::TableReader(const std::filesystem::path& file) : file_(file) {
  if (!std::filesystem::exists(file)) return;
  lines_.emplace(file);
  const auto header = lines_->next();
  if (!header) {
    lines_.reset();
    return;
  }
  if constexpr (Grown<Row>) {
    for (const std::string_view added : Columns<Row>::added) {
      if (*header + std::string(added) == Columns<Row>::header) {
        missing_ = std::size_t(std::count(added.begin(), added.end(), ','));
      }
    }
  }
  if (missing_ == 0 && *header != Columns<Row>::header) {
    refuse(file, 1, fmt::format("the first line must be {}", Columns<Row>::header));
  }
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
  if (fields.size() != count) {
    refuse(file_, lines_->number(), fmt::format("has {} fields, must have {}", fields.size(), count));
  }
  fields.resize(kCount);
  std::size_t at = 0;
  std::apply(
      [&](auto&... column) {
        const auto take = [&](auto& value) {
          if (!parse_field(fields[at], value)) {
            refuse(file_, lines_->number(), fmt::format("field {} is '{}', must be a number", at + 1, fields[at]));
          }
          ++at;
        };
        (take(column), ...);
      },
      columns);
  return row;
}

template class TableReader<FrameRow>;
template class TableReader<DriveRow>;
template class TableReader<RangeRow>;
template class TableReader<FixRow>;
template class TableReader<SightingRow>;
template class TableReader<TimingRow>;
template class TableReader<TrackRow>;

std::string to_line(const FrameRow& row) { return line_of(row); }
std::string to_line(const DriveRow& row) { return line_of(row); }
std::string to_line(const RangeRow& row) { return line_of(row); }
std::string to_line(const FixRow& row) { return line_of(row); }
std::string to_line(const SightingRow& row) { return line_of(row); }
std::string to_line(const TimingRow& row) { return line_of(row); }
std::string to_line(const TrackRow& row) {
  TrackRow kept = row;
  if (kept.heading_rad) kept.heading_rad = nanoradians(*kept.heading_rad);
  return line_of(kept);
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
        refuse(file, lines.number(), fmt::format("'{}' is no number", line->substr(begin, end - begin)));
      }
      begin = end + 1;
    }
    if (v.size() != 8)
      refuse(file, lines.number(), fmt::format("has {} numbers, must have 8: t tx ty tz qx qy qz qw", v.size()));
    // The rotation may also have a small roll and pitch. The heading is the angle about z.
    const double heading = std::atan2(2 * (v[7] * v[6] + v[4] * v[5]), 1 - 2 * (v[5] * v[5] + v[6] * v[6]));
    rows.push_back({v[0], v[1], v[2], nanoradians(heading)});
  }
  return rows;
}

}  // namespace twocone::runlog
