// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/telemetry/telemetry.h"
#include "apps/viewer/serving.h"
#include "apps/web/server.h"
#include "hal/result.h"

namespace twocone::viewer {

/// Returns the run folders among `paths` and below them, sorted, without those inside another run.
/// @throws config::FileError for a path that does not exist, or that has no run in it
std::vector<std::filesystem::path> find_runs(const std::vector<std::filesystem::path>& paths);

/// Shows stored runs in browsers. A request names a run by its number in the list, and a frame by its number: it names
/// no file.
///
///     GET /runs                                    a list of objects, the runs with their most important results
///     GET /telemetry?run=0&from=0&count=450        JSON lines (docs/telemetry.md): `run`, then frames by their row
///     GET /image?run=0&view=lower&frame=12         the PNG file of the run folder
///     GET /cloud?run=0&frame=12                    its PLY file, of a frame that `clouds` in `run` lists
class StoredRuns final : private web::Site {
 public:
  static constexpr std::size_t kMostFrames = 450;  ///< of one request

  /// @param folders of the runs
  explicit StoredRuns(std::vector<std::filesystem::path> folders);
  ~StoredRuns() override;

  /// Begins to serve, and returns the page's address with its token. Errors: those of web::Server::open
  Result<std::string> open(const PageAddress& at);

 private:
  std::optional<web::Answer> get(std::string_view path, const web::Query& query) override;
  [[nodiscard]] std::string list() const;
  /// Returns a file of a run, unless it is elsewhere.
  [[nodiscard]] std::optional<web::Answer> file_of(std::size_t number, const std::filesystem::path& file,
                                                   const char* type) const;
  [[nodiscard]] const telemetry::StoredRun& run(std::size_t number);

  std::vector<std::filesystem::path> folders_;
  struct Open {
    std::size_t number;
    std::unique_ptr<telemetry::StoredRun> run;
  };
  std::list<Open> open_;                 // the one that was used last comes first
  std::unique_ptr<web::Server> server_;  // its thread uses all members above
};

}  // namespace twocone::viewer
