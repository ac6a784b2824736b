// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/sim_povray/pixel_truth.h"
#include "drivers/sim_povray/render/native/tile_tracer.h"
#include "drivers/sim_povray/render/native/traced_scene.h"
#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene_text.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Parses a RenderJob::pose. Nothing if it is not of the form that Scene::pose_text() writes.
std::optional<Poses> parse_poses(std::string_view pose_text);

/// Renders the images of one view. May be used by several threads at once.
///
/// Rays from the camera to the robot's own mirror, and what the mirror reflects them to, are fixed in the robot's frame
/// and found once. An image then follows only the reflected rays, unless something has come between camera and mirror.
class NativeView {
 public:
  /// @param path of the scene, for messages @param read obeys what the scene may read
  /// Errors: kRefused: the scene needs POV-Ray; the message has file, line and keyword.
  static Result<std::shared_ptr<const NativeView>> make(const ViewTemplate& view_template, const std::string& path,
                                                        const IncludeReader& read);

  /// The poses of an image, and what follows from them for all of its bands.
  struct Moment {
    PosedScene posed;
    /// Whether the camera sees nothing but the robot where the plan says so.
    bool is_planned;
  };
  [[nodiscard]] Moment at(Poses poses) const;

  /// Renders some of the rows into an image of the view's size, which is black at first. Different bands may be
  /// rendered at the same time. @param moment of this view @param band from 0 to below bands()
  /// @param truth also receives the band's rows of what empty_truth() returned; null: none is wanted
  void render(const Moment& moment, int band, Image& image, PixelTruth* truth = nullptr) const {
    antialias_ > 1 ? render_smoothed(moment, band, image, truth) : render_plain(moment, band, image, truth);
  }
  /// Does so without anti-aliasing.
  void render_plain(const Moment& moment, int band, Image& image, PixelTruth* truth = nullptr) const;
  [[nodiscard]] int bands() const;
  /// Returns the first of the bands that hold these rows, and the one after the last.
  [[nodiscard]] std::pair<int, int> bands_of(const RowRange& rows) const;
  /// Returns the number of pixels that show the robot's own mirror; 0 if it is not known.
  [[nodiscard]] std::size_t mirror_pixels() const;
  /// Returns the truth of an image that shows nothing. The first call takes some milliseconds.
  /// Errors: kRefused: the scene has more objects than there are numbers.
  [[nodiscard]] Result<PixelTruth> empty_truth() const;
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  static constexpr int kTileSide = 8;
  static_assert(kTileSide * kTileSide == kTileRays);
  // POV-Ray smooths an image in squares of this size, from the window's corner, each for itself: measured.
  static constexpr int kBlock_px = 32;
  static_assert(kBlock_px % kTileSide == 0);

  /// What a pixel shows that does not change while only the robot moves.
  struct FixedPixel {
    enum class Kind : std::uint8_t {
      kAny,       ///< nothing is known
      kConstant,  ///< `colour`
      kMirror,    ///< `colour`, and `share` of what the reflected ray meets
    };
    Kind kind = Kind::kAny;
    Colour colour{}, share{};

    friend bool operator==(const FixedPixel&, const FixedPixel&) = default;
  };
  /// The reflected rays of kTileSide x kTileSide pixels, in the coordinates in which the scene shows the robot.
  struct FixedTile {
    TileVectors origin, direction;
    std::uint64_t mirror = 0;    ///< pixels of kind kMirror, row by row; the others repeat the ray of one that is
    std::uint64_t constant = 0;  ///< pixels of kind kConstant
    std::uint64_t unknown = 0;   ///< pixels of kind kAny
    /// What all pixels of a kind have in common, which is much less to read than all of them; none: they differ.
    std::optional<FixedPixel> common_mirror{}, common_constant{};
    /// Where the rays may meet anything: all groups, if one of them meets the robot itself, else all others.
    GroupSet surroundings = 0;
  };

  /// The samples of a tile's pixels for anti-aliasing, in the order pixel, row, column.
  struct FixedSamples {
    struct Sample {
      FixedPixel::Kind kind = FixedPixel::Kind::kAny;  ///< also if it is neither `mirror` nor `constant`
      Ray reflected{};                                 ///< in the robot's frame
    };
    std::vector<Sample> samples{};
    FixedPixel mirror{}, constant{};
    GroupSet surroundings = 0;  ///< as FixedTile's
  };
  struct SmoothedBlock;
  struct ImagePoint {
    double column, row;  ///< of the image's left and upper edge on: (0.5, 0.5) is the first pixel's centre
  };
  struct MirrorSample {
    const FixedSamples* tile;
    const Ray* reflected;
    std::size_t index;  ///< of the sample's colour
  };
  /// A pixel of a block, from its upper left corner.
  struct BlockPlace {
    int x, y;
  };

  NativeView(EvaluatedScene scene, const ViewTemplate& view_template);

  static ImagePoint centre_of(int x, int y) { return {x + 0.5, y + 0.5}; }
  [[nodiscard]] ImagePoint sample_point(int x, int y, int number) const;
  [[nodiscard]] Ray camera_ray(const ImagePoint& point) const;
  /// @param end where the camera's ray ends
  FixedPixel fixed_pixel(const Ray& ray, Ray& reflected, bool& meets_own, Vec3& end) const;
  [[nodiscard]] FixedTile fixed_tile(int column, int row);
  /// Returns the samples of a pixel's tile. They are found when they are first asked for.
  [[nodiscard]] const FixedSamples& fixed_samples(int x, int y) const;
  [[nodiscard]] FixedSamples samples_of_tile(int column, int row) const;
  void plan();
  [[nodiscard]] bool is_plan_valid(const Poses& poses) const;
  void render_smoothed(const Moment& moment, int band, Image& image, PixelTruth* truth) const;
  /// Sets what the mirror's pixels of a tile reflect. @param lanes of these pixels
  void reflect(const Moment& moment, int column, int row, std::uint64_t lanes, TileVectors& tile,
               PixelTruth* truth) const;
  /// Sets what the camera sees through points of the image. @param truth only if these are pixels' centres
  void look(const Moment& moment, std::span<const ImagePoint> points, std::span<Colour> colours,
            PixelTruth* truth = nullptr) const;
  /// Smooths a block whose centres are set, as POV-Ray's `+AM1 +A0.03` does (measured).
  void smooth(const Moment& moment, int left, int right, int top, int bottom, SmoothedBlock& block) const;
  void take_samples(const Moment& moment, int left, int top, std::span<const BlockPlace> places,
                    SmoothedBlock& block) const;
  /// Sets what samples of the mirror reflect.
  void reflect(const Moment& moment, std::span<const MirrorSample> wanted, std::span<Colour> colours) const;
  /// Returns the index of a pixel's tile in tiles_.
  [[nodiscard]] std::size_t tile_index(int x, int y) const;
  [[nodiscard]] const FixedTile& fixed_tile_at(int x, int y) const { return tiles_[tile_index(x, y)]; }
  /// Returns a pixel's lane in its tile.
  [[nodiscard]] std::size_t lane_of(int x, int y) const;
  /// Returns the index of a tile's pixel. @param column,row of the tile's first pixel
  [[nodiscard]] std::size_t pixel_of(int column, int row, int lane) const;
  [[nodiscard]] std::size_t pixel_index(int x, int y) const {
    return std::size_t(y) * std::size_t(width_px_) + std::size_t(x);
  }
  /// Finds what the centres of rows show, all of which are of the window. Calls `visit(column, row, lanes, colours)`
  /// for tiles that begin there, with the lanes that are of these rows. @param truth as in render()
  using TileVisitor = std::function<void(int column, int row, std::uint64_t lanes, const TileVectors& colours)>;
  void visit_tiles(const Moment& moment, int first_row, int last_row, PixelTruth* truth,
                   const TileVisitor& visit) const;
  /// Stores some lanes of a tile as pixels of an image's row.
  static void store(const TileBytes& bytes, int first_lane, int count, std::size_t pixel, Image& image);
  /// Sets what the centres of a tile's pixels show. @param inside the pixels that are wanted
  void tile_centres(const Moment& moment, int column, int row, std::uint64_t inside, TileVectors& tile,
                    PixelTruth* truth) const;

  /// What truth needs besides the plan. It is made when the first truth is asked for.
  struct TruthPlan {
    struct Fixed {
      int number = -1;  ///< Meeting::number; -1: the pixel's ray is followed in each image
      double distance = 0;
      Vec3 normal{};  ///< on the side that is seen
    };
    std::vector<std::uint16_t> numbers{};  ///< TrueObject::number by Item::number; 0: a mask, which is no object
    std::shared_ptr<const std::vector<TrueObject>> objects{};
    std::vector<Fixed> fixed{};  ///< of fixed_; in the robot's frame
    bool is_too_large = false;
  };
  void plan_truth() const;
  [[nodiscard]] bool is_own_mirror(int number, const Texture& texture) const;
  /// Sets what a pixel shows. @param number Item::number @param normal on the side that is seen
  void set_truth(PixelTruth& truth, std::size_t pixel, int number, double distance, const Vec3& normal) const;
  /// Sets what a lane's pixel shows. @param is_reflected the rays come from the robot's own mirror
  void set_truth(PixelTruth& truth, std::size_t pixel, const SeenTile& seen, int lane, bool is_reflected) const;

  TracedScene scene_;
  int width_px_, height_px_;
  int antialias_;
  Window window_;
  GroupSet own_ = 0;                 ///< the robot and what moves with the view
  int robot_ = -1;                   ///< the mover that moves as the view does
  std::vector<FixedPixel> fixed_{};  ///< of the image, row by row
  std::vector<FixedTile> tiles_{};   ///< of the window, row by row
  struct LazySamples {
    std::once_flag made{};
    FixedSamples samples{};
  };
  mutable std::vector<LazySamples> samples_{};  ///< of tiles_; empty: without anti-aliasing, or too many to keep
  Bounds3 sight_{};                             ///< holds the rays from the camera to what fixed pixels show
  double unit_m_;
  mutable std::once_flag truth_planned_{};
  mutable TruthPlan truth_plan_{};
};

}  // namespace twocone::sim_povray
