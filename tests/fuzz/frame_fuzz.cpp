// SPDX-License-Identifier: Apache-2.0
// Feeds damaged frames, as a bad cable delivers them, to the conversion that every consumer calls: JPEG images that are
// changed, truncated, joined from two, or noise; raw images of any length and with sides that their format cannot have.
// The exit status is 1 if a result is neither kBadData nor an image of the right size. A crash or a report of a
// sanitizer ends the program earlier.
//   frame_fuzz TIMES SEED
#include <turbojpeg.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

#include "hal/image.h"

using namespace twocone;  // NOLINT(google-build-using-namespace): this is a separate program

namespace {

using Octets = std::vector<std::uint8_t>;

struct Seed {
  int width_px;
  int height_px;
  Octets jpeg;
};

class Frames {
 public:
  explicit Frames(std::uint64_t seed) : random_(seed) {
    constexpr std::array kSamplings{TJSAMP_444, TJSAMP_422, TJSAMP_420, TJSAMP_GRAY};
    constexpr std::array<std::array<int, 2>, 3> kSizes{{{1, 1}, {16, 8}, {37, 21}}};
    for (const int sampling : kSamplings) {
      for (const auto& [width_px, height_px] : kSizes) {
        for (const int flags : {0, TJFLAG_PROGRESSIVE}) seeds_.push_back(encoded(width_px, height_px, sampling, flags));
      }
    }
  }

  Image next() { return below(2) == 0 ? jpeg() : raw(); }

 private:
  std::uint64_t below(std::uint64_t end) { return random_() % end; }

  std::uint8_t octet() {
    // Bytes of JPEG's markers and lengths, and the extreme values of a byte.
    constexpr std::array<std::uint8_t, 12> kEdges{0x00, 0x01, 0x7f, 0x80, 0xff, 0xc0,
                                                  0xc2, 0xc4, 0xd0, 0xd9, 0xda, 0xdb};
    return below(2) == 0 ? kEdges[below(kEdges.size())] : std::uint8_t(random_());
  }

  Octets noise(std::uint64_t size) {
    Octets octets(size);
    for (auto& each : octets) each = std::uint8_t(random_());
    return octets;
  }

  Seed encoded(int width_px, int height_px, int sampling, int flags) {
    struct Destroy {
      void operator()(void* handle) const { tjDestroy(handle); }
    };
    const std::unique_ptr<void, Destroy> encoder(tjInitCompress());
    const Octets rgb = noise(3 * std::size_t(width_px) * height_px);
    unsigned char* octets = nullptr;
    unsigned long size = 0;
    if (tjCompress2(encoder.get(), rgb.data(), width_px, 0, height_px, TJPF_RGB, &octets, &size, sampling, 70, flags) !=
        0) {
      std::fprintf(stderr, "no JPEG to begin with: %s\n", tjGetErrorStr2(encoder.get()));
      std::exit(1);
    }
    Seed seed{width_px, height_px, Octets(octets, octets + size)};
    tjFree(octets);
    return seed;
  }

  Image jpeg() {
    const Seed& seed = seeds_[below(seeds_.size())];
    Image image{seed.width_px, seed.height_px, PixelFormat::kMjpeg, {}};
    if (below(16) == 0) image.width_px = side();
    if (below(16) == 0) image.height_px = side();
    Octets octets = below(16) == 0 ? noise(below(200)) : seed.jpeg;
    for (auto changes = below(6); changes > 0 && !octets.empty(); --changes) octets[below(octets.size())] = octet();
    if (below(8) == 0) {  // the beginning of one image and the end of another
      const Octets& other = seeds_[below(seeds_.size())].jpeg;
      octets.resize(below(octets.size() + 1));
      octets.insert(octets.end(), other.begin() + std::ptrdiff_t(below(other.size())), other.end());
    }
    if (below(8) == 0) octets.resize(below(octets.size() + 1));
    if (below(8) == 0) {
      const auto at = std::ptrdiff_t(below(octets.size() + 1));
      octets.insert(octets.begin() + at, below(32), octet());
    }
    image.bytes = std::move(octets);
    return image;
  }

  int side() {
    constexpr std::array kEdges{-1, 0, 1, 65535, 65536, 2147483647, -2147483647 - 1};
    return below(8) == 0 ? kEdges[below(kEdges.size())] : int(below(40));
  }

  Image raw() {
    constexpr std::array kFormats{PixelFormat::kRgb8, PixelFormat::kBgr8, PixelFormat::kGrey8,
                                  PixelFormat::kYuyv, PixelFormat::kUyvy, PixelFormat::kNv12};
    Image image{side(), side(), kFormats[below(kFormats.size())], {}};
    // The length is mostly right, or nearly. If the sides are not valid for this format, it is the length of another
    // format.
    auto size = image_bytes(image.format, image.width_px, image.height_px);
    if (!size || below(8) == 0) {
      size = image_bytes(kFormats[below(kFormats.size())], image.width_px, image.height_px);
    }
    constexpr std::size_t kMost = 8192;
    std::size_t length = size && *size < kMost ? *size : below(kMost);
    if (below(4) == 0) length += below(9);
    if (below(4) == 0) length -= std::min<std::size_t>(length, below(9));
    image.bytes = noise(length);
    return image;
  }

  std::mt19937_64 random_;
  std::vector<Seed> seeds_;
};

bool is_right(const Image& image, const Result<Image>& rgb) {
  if (!rgb) return rgb.error().code == ErrorCode::kBadData;
  return rgb->format == PixelFormat::kRgb8 && rgb->width_px == image.width_px && rgb->height_px == image.height_px &&
         rgb->bytes.size() == image_bytes(PixelFormat::kRgb8, image.width_px, image.height_px);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): an exception is a finding and ends the program
int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("frame_fuzz TIMES SEED\n", stderr), 2;
  const auto times = std::strtoull(argv[1], nullptr, 10);
  Frames frames(std::strtoull(argv[2], nullptr, 10));
  unsigned long long jpegs = 0, raws = 0, good_jpegs = 0, good_raws = 0;
  for (unsigned long long i = 0; i < times; ++i) {
    const Image image = frames.next();
    const bool is_jpeg = image.format == PixelFormat::kMjpeg;
    const auto rgb = to_rgb8(image);
    if (!is_right(image, rgb)) {
      std::fprintf(stderr, "frame %llu: %d x %d %s of %zu bytes: a wrong answer\n", i, image.width_px, image.height_px,
                   std::string(to_string(image.format)).c_str(), image.bytes.size());
      return 1;
    }
    ++(is_jpeg ? jpegs : raws);
    if (rgb) ++(is_jpeg ? good_jpegs : good_raws);
  }
  std::printf("%llu images: %llu JPEG (%llu of them good), %llu raw (%llu of them good)\n", times, jpegs, good_jpegs,
              raws, good_raws);
  // If all images were good or all were bad, the test would not have covered both cases.
  return times < 1000 || (good_jpegs > 0 && good_jpegs < jpegs && good_raws > 0 && good_raws < raws) ? 0 : 1;
}
