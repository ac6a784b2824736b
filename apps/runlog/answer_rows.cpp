// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/answer_rows.h"

#include <cmath>
#include <tuple>

#include "vision/scan.h"

namespace twocone::runlog {
namespace {

void add_sighting(std::uint64_t frame, double t_s, const std::string& landmark, const char* view,
                  const std::optional<vision::Sighting>& sighting, std::vector<SightingRow>& rows) {
  if (!sighting) return;
  const Eigen::Matrix2d& covariance = sighting->covariance_px2;
  rows.push_back({frame, t_s, landmark, view, sighting->pixel_px.x(), sighting->pixel_px.y(), covariance(0, 0),
                  covariance(0, 1), covariance(1, 1), sighting->edge_noise_px});
}

/// Sets the row's covariance. @param covariance of x, y and heading; without a heading, its entries are not used
template <typename Row>
void set_covariance(const std::optional<Eigen::Matrix3d>& covariance, bool has_heading, Row& row) {
  const auto entry = [&](int i, int j, bool is_there) {
    return covariance && is_there ? std::optional((*covariance)(i, j)) : std::nullopt;
  };
  row.var_x_m2 = entry(0, 0, true);
  row.cov_xy_m2 = entry(0, 1, true);
  row.var_y_m2 = entry(1, 1, true);
  row.cov_x_heading_m_rad = entry(0, 2, has_heading);
  row.cov_y_heading_m_rad = entry(1, 2, has_heading);
  row.var_heading_rad2 = entry(2, 2, has_heading);
}

}  // namespace

AnswerRows to_rows(std::uint64_t frame, double t_s, const estimation::FrameAnswer& answer, const config::Map& map,
                   const PoseRow* truth) {
  AnswerRows rows;
  for (std::size_t i = 0; i < answer.ranges.size(); ++i) {
    const vision::RangeMeasurement& m = answer.ranges[i];
    const config::Landmark& landmark = map.landmarks[i];
    std::optional<double> true_range_m;
    if (truth) true_range_m = std::hypot(landmark.x_m - truth->x_m, landmark.y_m - truth->y_m);
    rows.ranges.push_back({frame, t_s, landmark.name, std::string(to_string(m.verdict)), m.range_m, m.sigma_range_m,
                           m.bearing_rad, m.sigma_bearing_rad, m.disparity_px, true_range_m});
    add_sighting(frame, t_s, landmark.name, "lower", m.lower_sighting, rows.sightings);
    add_sighting(frame, t_s, landmark.name, "upper", m.upper_sighting, rows.sightings);
  }

  const localisation::Fix& fix = answer.fix;
  FixRow row;
  row.frame = frame;
  row.t_s = t_s;
  row.verdict = to_string(fix.verdict);
  for (const int index : fix.outliers) row.outliers.push_back(map.landmarks.at(std::size_t(index)).name);
  if (fix.unseen_direction) {
    row.unseen_x = fix.unseen_direction->x();
    row.unseen_y = fix.unseen_direction->y();
    row.unseen_heading = fix.unseen_direction->z();
  }
  if (truth) {
    row.true_x_m = truth->x_m;
    row.true_y_m = truth->y_m;
  }
  for (const auto& [position, heading_rad, covariance, own] :
       {std::tie(fix.position_m, fix.heading_rad, fix.covariance, fix.own_covariance),
        std::tie(fix.other_position_m, fix.other_heading_rad, fix.other_covariance, fix.other_own_covariance)}) {
    if (!position) continue;
    row.heading_rad = heading_rad;
    set_covariance(covariance, heading_rad.has_value(), row);
    row.own_var_x_m2 = own ? std::optional((*own)(0, 0)) : std::nullopt;
    row.own_cov_xy_m2 = own ? std::optional((*own)(0, 1)) : std::nullopt;
    row.own_var_y_m2 = own ? std::optional((*own)(1, 1)) : std::nullopt;
    row.own_var_heading_rad2 = own && heading_rad ? std::optional((*own)(2, 2)) : std::nullopt;
    row.x_m = position->x();
    row.y_m = position->y();
    // A position out of bounds is no answer, so it has no error.
    if (truth && fix.verdict != localisation::FixVerdict::kOutOfBounds)
      row.error_m = std::hypot(position->x() - truth->x_m, position->y() - truth->y_m);
    rows.fixes.push_back(row);
  }
  if (rows.fixes.empty()) rows.fixes.push_back(row);
  return rows;
}

TrackRow to_row(std::uint64_t frame, double t_s, const localisation::Fix& fix, const estimation::TrackAnswer& answer) {
  TrackRow row;
  row.frame = frame;
  row.t_s = t_s;
  row.fix = to_string(fix.verdict);
  row.use = to_string(answer.use);
  if (answer.plan_use) row.plan = to_string(*answer.plan_use);
  if (answer.state) row.state = to_string(*answer.state);
  if (answer.position_m) {
    row.x_m = answer.position_m->x();
    row.y_m = answer.position_m->y();
    row.heading_rad = answer.heading_rad;
  }
  set_covariance(answer.covariance, true, row);
  return row;
}

std::vector<ScanRow> to_rows(std::uint64_t frame, double t_s, const std::vector<vision::Beam>& scan) {
  const auto rounded = [](double value, double per) { return std::round(value * per) / per; };
  std::vector<ScanRow> rows;
  rows.reserve(scan.size());
  for (std::size_t k = 0; k < scan.size(); ++k) {
    const vision::Beam& beam = scan[k];
    ScanRow& row = rows.emplace_back(ScanRow{frame,
                                             t_s,
                                             rounded(vision::beam_bearing_rad(k, scan.size()), 1e5),
                                             std::string(to_string(beam.state)),
                                             {},
                                             {}});
    if (beam.state != vision::BeamState::kUnknown) row.range_m = rounded(beam.range_m, 1e4);
    if (beam.state == vision::BeamState::kOccupied) row.sigma_m = rounded(beam.sigma_m, 1e4);
  }
  return rows;
}

std::map<std::uint64_t, std::vector<vision::Beam>> read_scans(const std::filesystem::path& file) {
  std::map<std::uint64_t, std::vector<vision::Beam>> scans;
  TableReader<ScanRow> rows(file);
  while (const auto row = rows.next()) {
    vision::Beam& beam = scans[row->frame].emplace_back();
    if (row->state == to_string(vision::BeamState::kFree)) beam.state = vision::BeamState::kFree;
    if (row->state == to_string(vision::BeamState::kOccupied)) beam.state = vision::BeamState::kOccupied;
    beam.range_m = row->range_m.value_or(0);
    beam.sigma_m = row->sigma_m.value_or(0);
  }
  return scans;
}

AnswerReader::AnswerReader(const std::filesystem::path& run, const std::string& method)
    : ranges_(results_folder(run, method) / "ranges.csv"),
      fixes_(results_folder(run, method) / "fixes.csv"),
      sightings_(results_folder(run, method) / "sightings.csv") {}

template <typename Row>
std::vector<Row> AnswerReader::take(Table<Row>& table, std::uint64_t frame) {
  std::vector<Row> rows;
  for (; table.row && table.row->frame <= frame; table.row = table.reader.next()) {
    if (table.row->frame == frame) rows.push_back(*std::move(table.row));
  }
  return rows;
}

AnswerRows AnswerReader::of(std::uint64_t frame) {
  AnswerRows rows;
  rows.ranges = take(ranges_, frame);
  rows.fixes = take(fixes_, frame);
  rows.sightings = take(sightings_, frame);
  return rows;
}

}  // namespace twocone::runlog
