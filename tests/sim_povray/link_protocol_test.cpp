// SPDX-License-Identifier: Apache-2.0
// The parts of a link without a server: messages, shared memory, permissions, and the name of a world.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <random>
#include <set>

#include "drivers/sim_povray/server/images.h"
#include "drivers/sim_povray/server/protocol.h"
#include "drivers/sim_povray/server/socket.h"
#include "tests/sim_povray/link_messages.h"
#include "tests/sim_povray/link_support.h"
#include "tests/support/fails_with.h"
#include "tests/support/value.h"

namespace twocone::sim_povray::server {
namespace {

using std::chrono::milliseconds;
using testing_support::FailsWith;
using testing_support::value;

// ---- messages

template <typename T>
const T& as(const std::optional<Message>& message) {
  return std::get<T>(message.value());
}

TEST(LinkProtocol, EveryKindOfMessageIsAmongTheSamples) {
  std::set<std::size_t> kinds;
  for (const Message& message : sample_messages()) kinds.insert(message.index());
  EXPECT_EQ(kinds.size(), std::variant_size_v<Message>);
}

// The second encoding equals the first only if each field survives. A field that one direction swaps with its neighbour
// or omits is noticed, because no sample field equals another or its default.
TEST(LinkProtocol, MessagesSurviveEncodingAndDecoding) {
  for (const Message& message : sample_messages()) {
    const auto bytes = encode(message);
    EXPECT_LE(bytes.size(), kMaxMessage);
    const auto back = decode(bytes);
    ASSERT_TRUE(back) << "kind " << message.index();
    EXPECT_EQ(back->index(), message.index());
    EXPECT_EQ(encode(*back), bytes) << "kind " << message.index();
  }
}

// The messages with many fields are checked by field: the order of fields is the same in both directions by
// construction, but the test above would not notice a field that both directions omit.
TEST(LinkProtocol, SettingsSurviveFieldByField) {
  const auto samples = sample_messages();
  const auto session = as<Take>(decode(encode(samples.at(2)))).settings;
  EXPECT_EQ(session.name, "2");
  EXPECT_EQ(session.body.start, (Pose2{1.5, -2.25, 0.7}));
  EXPECT_EQ(session.body.begin, (Pose2{-0.4, 1.25, 2.6}));
  EXPECT_EQ(session.body.wheels.slip, 0.013);
  EXPECT_EQ(session.body.wheels.slip_correlation_s, 2.2);
  EXPECT_EQ(session.body.wheels.encoder_counts_per_turn, 1024);
  EXPECT_EQ(session.body.wheels.lag_s, 0.11);
  EXPECT_EQ(session.body.command_timeout, std::chrono::nanoseconds(412));
  ASSERT_TRUE(session.body.physics);
  EXPECT_EQ(session.body.physics->wheel_friction, 0.77);
  EXPECT_EQ(session.body.seed, 0xfedcba9876543210);
  EXPECT_EQ(session.drive.max_speed_radps, 9.5);
  EXPECT_EQ(session.run_ahead_frames, 7);
  EXPECT_FALSE(as<Take>(decode(encode(samples.at(3)))).settings.body.physics);

  const auto view = as<OpenView>(decode(encode(samples.at(4)))).settings;
  EXPECT_EQ(view.camera_name, "upper");
  EXPECT_EQ(view.antialias, 3);
  EXPECT_EQ(view.effects, std::get<OpenView>(samples.at(4)).settings.effects);

  const auto state = as<Stepped>(decode(encode(samples.at(13)))).state;
  EXPECT_EQ(state.step, 41u);
  EXPECT_EQ(state.now, std::chrono::nanoseconds(2733));
  EXPECT_EQ(state.pose, (Pose2{0.1, 0.2, -0.3}));
  EXPECT_EQ(state.right_rad, 5.5);
  EXPECT_EQ(state.contact, "landmark red");
}

TEST(LinkProtocol, CutOrTooLongBytesAreNoMessage) {
  for (const Message& message : sample_messages()) {
    auto bytes = encode(message);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_FALSE(decode({bytes.data(), size})) << "kind " << message.index() << " cut to " << size;
    }
    bytes.push_back(0);
    EXPECT_FALSE(decode(bytes)) << "kind " << message.index();
  }
}

TEST(LinkProtocol, ImpossibleKindsCodesAndLengthsAreRefused) {
  for (int kind = int(std::variant_size_v<Message>); kind < 256; ++kind) {
    EXPECT_FALSE(decode(std::array{std::uint8_t(kind)})) << kind;
  }
  auto failed = encode(Failed{ErrorCode::kRefused, "no"});
  failed.at(1) = std::uint8_t(ErrorCode::kRefused) + 1;
  EXPECT_FALSE(decode(failed));
  failed = encode(Failed{ErrorCode::kRefused, "no"});
  for (std::size_t i = 2; i < 6; ++i) failed.at(i) = 0xff;  // a text of 4 GiB
  EXPECT_FALSE(decode(failed));
  auto done = encode(ImageDone{1, PixelFormat::kGrey8});
  done.back() = std::uint8_t(PixelFormat::kGrey8) + 1;
  EXPECT_FALSE(decode(done));
}

TEST(LinkProtocol, ALongTextIsCutAndAccepted) {
  const auto back = decode(encode(Failed{ErrorCode::kBadData, std::string(100'000, 'x')}));
  EXPECT_EQ(as<Failed>(back).message, std::string(kMaxText, 'x'));
}

TEST(LinkProtocol, GarbageIsNeverReadBeyondItsEnd) {  // AddressSanitizer checks this
  std::mt19937_64 random(20260721);
  const auto samples = sample_messages();
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::uint8_t> bytes = encode(samples[random() % samples.size()]);
    for (auto changes = random() % 4; changes > 0; --changes) bytes[random() % bytes.size()] = std::uint8_t(random());
    if (random() % 2 == 0) bytes.resize(random() % (bytes.size() + 1));
    // This copy has no spare capacity, so that the sanitizer notices a read beyond its end.
    const std::vector<std::uint8_t> exact(bytes.begin(), bytes.end());
    if (const auto message = decode(exact)) {
      EXPECT_EQ(encode(*message), exact);
    }
  }
}

// ---- shared memory

TEST(LinkSharedFrames, TheReaderReadsTheBytesOfTheWriter) {
  auto writer = value(SharedFrames::allocate(3, 1000));
  auto reader = value(SharedFrames::adopt(writer.take_file(), 3, 1000));
  for (std::uint32_t slot = 0; slot < 3; ++slot) {
    for (std::size_t i = 0; i < 1000; ++i) writer.write(slot)[i] = std::uint8_t(slot * 50 + i);
  }
  for (std::uint32_t slot = 0; slot < 3; ++slot) {
    for (std::size_t i = 0; i < 1000; ++i) ASSERT_EQ(reader.read(slot)[i], std::uint8_t(slot * 50 + i));
  }
}

TEST(LinkSharedFrames, TheFileOfAReaderCannotBeShortened) {
  auto writer = value(SharedFrames::allocate(1, 100'000));
  const base::UniqueFd file = writer.take_file();
  EXPECT_NE(::ftruncate(file.get(), 10), 0);
  EXPECT_NE(::ftruncate(file.get(), 200'000), 0);
  EXPECT_NE(::fcntl(file.get(), F_ADD_SEALS, F_SEAL_WRITE), 0) << "the seals themselves are sealed";
}

TEST(LinkSharedFrames, AFileWithoutSealsOrOfAnotherSizeIsNotAdopted) {
  base::UniqueFd loose(::memfd_create("loose", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  ASSERT_EQ(::ftruncate(loose.get(), 300), 0);
  EXPECT_THAT(SharedFrames::adopt(std::move(loose), 3, 100), FailsWith(ErrorCode::kBadData));
  auto writer = value(SharedFrames::allocate(3, 100));
  EXPECT_FALSE(SharedFrames::adopt(writer.take_file(), 3, 101));
  EXPECT_FALSE(SharedFrames::adopt(base::UniqueFd(), 3, 100));
}

TEST(LinkSharedFrames, MissingMemoryIsAnErrorAndNoSignal) {
  constexpr std::uint64_t kTebibyte = std::uint64_t{1} << 40;  // more than the free memory of any test machine
  const auto huge = SharedFrames::allocate(256, kTebibyte / 64);
  ASSERT_THAT(huge, FailsWith(ErrorCode::kUnavailable));
  EXPECT_NE(huge.error().message.find("MB are free"), std::string::npos) << huge.error().message;

  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{4096, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto limited = SharedFrames::allocate(2, 4096);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_THAT(limited, FailsWith(ErrorCode::kUnavailable));
}

// ---- packets

struct Pair {
  Pair() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0) std::abort();
    near = base::UniqueFd(ends[0]);
    far = base::UniqueFd(ends[1]);
  }
  base::UniqueFd near, far;
};

TEST(LinkSocket, EveryWaitEndsAtItsDeadline) {
  const Pair pair;
  EXPECT_THAT(receive_message(pair.near.get(), in(milliseconds(20))), FailsWith(ErrorCode::kTimeout));
  Status sent;
  for (int i = 0; i < 100'000 && sent; ++i) sent = send_message(pair.near.get(), Halt{}, in(milliseconds(20)));
  ASSERT_THAT(sent, FailsWith(ErrorCode::kTimeout)) << "the other end never read";
}

TEST(LinkSocket, AClosedEndIsAnErrorAndNoSignal) {
  Pair pair;
  EXPECT_FALSE(hung_up(pair.near.get()));
  ASSERT_TRUE(send_message(pair.near.get(), Halt{}, in(milliseconds(20))));  // never read: closing resets the link
  ASSERT_TRUE(send_message(pair.far.get(), Failed{ErrorCode::kRefused, "why"}, in(milliseconds(20))));
  pair.far.reset();
  EXPECT_TRUE(hung_up(pair.near.get()));
  const auto last_message = receive_message(pair.near.get(), in(milliseconds(20)));
  ASSERT_TRUE(last_message) << "the peer's last message before it closed is lost: " << last_message.error().message;
  EXPECT_EQ(std::get<Failed>(*last_message->message).message, "why");
  EXPECT_EQ(receive_message(pair.near.get(), in(milliseconds(20))).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(send_message(pair.near.get(), Halt{}, in(milliseconds(20))).error().code, ErrorCode::kDisconnected);
}

TEST(LinkSocket, APacketThatIsTooLongIsNoMessage) {
  const Pair pair;
  std::vector<std::uint8_t> bytes = encode(Failed{ErrorCode::kRefused, "x"});
  bytes.resize(kMaxMessage + 1);
  ASSERT_EQ(::send(pair.far.get(), bytes.data(), bytes.size(), 0), ssize_t(bytes.size()));
  const auto received = value(receive_message(pair.near.get(), in(milliseconds(20))));
  EXPECT_FALSE(received.message);
}

TEST(LinkSocket, UnexpectedFilesAreClosed) {
  const Pair pair;
  const base::UniqueFd file(::memfd_create("unexpected", MFD_CLOEXEC));
  const auto lowest_free = [] { return base::UniqueFd(::dup(0)).get(); };
  const int before = lowest_free();
  ASSERT_TRUE(send_message(pair.far.get(), Halt{}, in(milliseconds(20)), file.get()));
  const auto dropped = value(receive_message(pair.near.get(), in(milliseconds(20))));
  EXPECT_FALSE(dropped.file.valid());
  EXPECT_EQ(lowest_free(), before);
  ASSERT_TRUE(send_message(pair.far.get(), Halt{}, in(milliseconds(20)), file.get()));
  EXPECT_TRUE(receive_message(pair.near.get(), in(milliseconds(20)), Files::kTake)->file.valid());
}

TEST(LinkSocket, AnotherUserIsRefused) {
  EXPECT_TRUE(check_peer(Peer{1000, 77}, 1000));
  EXPECT_TRUE(check_peer(Peer{0, 77}, 0));
  for (const auto& [peer, own] : {std::pair<uid_t, uid_t>{1001, 1000}, {0, 1000}, {1000, 0}}) {
    const Status refused = check_peer(Peer{peer, 77}, own);
    ASSERT_THAT(refused, FailsWith(ErrorCode::kRefused)) << peer << " at " << own;
    EXPECT_NE(refused.error().message.find("pid 77"), std::string::npos);
  }
  EXPECT_FALSE(check_peer(std::nullopt, 0));
  const Pair pair;
  ASSERT_TRUE(peer_of(pair.near.get()));
  EXPECT_EQ(peer_of(pair.near.get())->user, ::geteuid());
  EXPECT_EQ(peer_of(pair.near.get())->process, ::getpid());
}

// ---- the name of a world

TEST(LinkName, BadNamesAreRefused) {
  const RuntimeFolder runtime;
  for (const std::string& name :
       std::initializer_list<std::string>{"", "../lab", "a/b", "l ab", "lab.", "läb", std::string(65, 'x')}) {
    EXPECT_THAT(world_socket(name), FailsWith(ErrorCode::kRefused)) << name;
  }
  const auto path = value(world_socket("Lab-2_x"));
  EXPECT_EQ(path, runtime.path() / "twocone" / "Lab-2_x.sock");
}

TEST(LinkName, TheFolderIsPrivateToTheUser) {
  const RuntimeFolder runtime;
  ASSERT_TRUE(world_socket("lab"));
  const std::filesystem::path folder = runtime.path() / "twocone";
  struct stat status {};
  ASSERT_EQ(::stat(folder.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0700u);
  ASSERT_EQ(::chmod(folder.c_str(), 0755), 0);
  ASSERT_FALSE(world_socket("lab"));
  EXPECT_NE(world_socket("lab").error().message.find("755"), std::string::npos);
  std::filesystem::remove(folder);
  std::filesystem::create_directory_symlink("/", folder);
  EXPECT_FALSE(world_socket("lab")) << "another user's folder behind a symbolic link";
}

TEST(LinkName, AFolderOfAnotherUserIsRefused) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a folder of another user";
  const RuntimeFolder runtime;
  ASSERT_TRUE(world_socket("lab"));
  ASSERT_EQ(::chown((runtime.path() / "twocone").c_str(), 12345, 12345), 0);
  ASSERT_FALSE(world_socket("lab"));
  EXPECT_NE(world_socket("lab").error().message.find("12345"), std::string::npos);
}

TEST(LinkName, APathTooLongForASocketIsRefused) {
  const RuntimeFolder runtime;
  const std::filesystem::path deep = runtime.path() / std::string(100, 'd');
  std::filesystem::create_directory(deep);
  ::setenv("XDG_RUNTIME_DIR", deep.c_str(), 1);
  EXPECT_THAT(world_socket("lab"), FailsWith(ErrorCode::kRefused, testing::HasSubstr("too long")));
}

TEST(LinkName, OneClaimAtATimeAndNoFileIsLeft) {
  const RuntimeFolder runtime;
  const auto path = value(world_socket("lab"));
  {
    const auto first = value(ServedName::claim(path));
    EXPECT_THAT(ServedName::claim(path), FailsWith(ErrorCode::kRefused));
    sweep(path, milliseconds(0));
    EXPECT_EQ(runtime.files().size(), 1u) << "the lock of a running server was removed";
  }
  EXPECT_TRUE(runtime.files().empty());
}

TEST(LinkName, FilesOfADeadServerAreRemoved) {
  const RuntimeFolder runtime;
  const auto path = value(world_socket("lab"));
  // The state after kill -9: both files exist, and no process listens or holds the lock.
  ASSERT_TRUE(listen_at(path));
  std::ofstream(std::filesystem::path(path).replace_extension(".lock")) << "";
  ASSERT_EQ(runtime.files().size(), 2u);
  sweep(path, milliseconds(0));
  EXPECT_TRUE(runtime.files().empty());
}

}  // namespace
}  // namespace twocone::sim_povray::server
