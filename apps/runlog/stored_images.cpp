// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/stored_images.h"

#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::runlog {

StoredImages::StoredImages(std::filesystem::path folder) : folder_(std::move(folder)) {
  TableReader<FrameRow> rows(folder_ / "frames.csv");
  while (const auto row = rows.next()) {
    frame_of_[{"lower", row->lower_sequence}] = row->frame;
    frame_of_[{"upper", row->upper_sequence}] = row->frame;
    last_host_t_s_ = row->host_t_s.value_or(0);
    ++frames_;
  }
}

std::shared_ptr<const Image> StoredImages::operator()(const std::string& camera, std::uint64_t sequence) const {
  const auto frame = frame_of_.find({camera, sequence});
  if (frame == frame_of_.end()) return nullptr;
  auto image = read_image(camera_image_file(folder_, camera, frame->second));
  return image ? std::make_shared<const Image>(*std::move(image)) : nullptr;
}

}  // namespace twocone::runlog
