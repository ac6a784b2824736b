// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/storage/locked_folder.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runs/run.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::error_of;
using testing_support::TemporaryFolder;

/// Makes a run of `frames` frames that no program writes any more.
fs::path make_run(const TemporaryFolder& folder, const std::string& name, int frames) {
  RunFolder run(folder.path() / name);
  for (int frame = 0; frame < frames; ++frame) {
    FrameRecord record;
    record.frame.frame = std::uint64_t(frame);
    run.add(record, Image{1, 1, PixelFormat::kRgb8, {1, 2, 3}}, Image{1, 1, PixelFormat::kRgb8, {4, 5, 6}});
  }
  RunInfo info;
  info.method = "outline";
  write_run_yaml(run.path(), info, config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml"),
                 TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml");
  return run.path();
}

TEST(RunLock, ASecondWriterIsRefusedByNameUntilTheFirstHasEnded) {
  const TemporaryFolder folder;
  {
    const RunLock lock(folder.path());
    EXPECT_EQ(error_of<std::runtime_error>([&] { RunLock second(folder.path()); }),
              folder.path().string() + " is being written by another program (process " + std::to_string(::getpid()) +
                  "): wait until that has ended, or choose another folder");
    EXPECT_FALSE(RunLock::try_take(folder.path()));
  }
  EXPECT_EQ(folder.read(RunLock::kFileName), "") << "equal runs have equal files";
  EXPECT_TRUE(RunLock::try_take(folder.path()));
}

TEST(RunLock, EndsWithAProgramThatIsKilled) {
  const TemporaryFolder folder;
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const RunLock lock(folder.path());
    (void)folder.write("locked", "");
    while (true) ::pause();
  }
  for (int i = 0; i < 500 && !fs::exists(folder.path() / "locked"); ++i) ::usleep(10'000);
  EXPECT_THAT(error_of<std::runtime_error>([&] { RunLock second(folder.path()); }), HasSubstr(std::to_string(child)));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(error_of<std::runtime_error>([&] { RunLock second(folder.path()); }), "no error");
}

// Catches two programs that hold the lock of one folder because the lock file of one was removed.
TEST(RunLock, BelongsToThePresentFolder) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  fs::create_directories(run);
  const RunLock lock(run);
  fs::rename(run, folder.path() / "old");
  fs::create_directories(run);
  EXPECT_TRUE(RunLock::try_take(run));
}

// Other writers were possible: localise of a running run, a second localise, and --force on either.
TEST(RunLock, NobodyElseWritesWhileARunGoesOn) {
  const TemporaryFolder folder;
  const fs::path path = make_run(folder, "run", 1);
  const RunLock lock(path);
  const std::string held = "is being written by another program";
  EXPECT_THAT(
      error_of<std::runtime_error>([&] { (void)runs::localise(path, estimation::Method::kPaper, [](double) {}); }),
      HasSubstr(held));
  EXPECT_THAT(error_of<std::runtime_error>([&] { RunFolder again(path); }), HasSubstr(held));
  EXPECT_THAT(error_of<std::runtime_error>([&] { remove_run(path); }), HasSubstr(held));
  EXPECT_EQ(read_run(path).frames.size(), 1U) << "it can still be read";
}

TEST(NewFolder, IsRemovedUnlessItIsKept) {
  const TemporaryFolder folder;
  { const NewFolder made(folder.path() / "run"); }
  EXPECT_FALSE(fs::exists(folder.path() / "run"));
  fs::create_directories(folder.path() / "mine");
  (void)folder.write("mine/notes.txt", "my own");
  {
    const NewFolder made(folder.path() / "mine");
    write_whole(folder.path() / "mine" / "run.yaml", "");
  }
  EXPECT_EQ(folder.read("mine/notes.txt"), "my own");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "mine"), {}), 1) << "something of it remains";
  {
    NewFolder made(folder.path() / "run");
    made.keep();
  }
  EXPECT_TRUE(fs::exists(folder.path() / "run" / "upper"));
}

// A failed start blocked the next one.
TEST(NewFolder, AStartWithoutAFrameMayBeReplacedButARunMayNot) {
  const TemporaryFolder folder;
  const fs::path started = make_run(folder, "run", 0);
  ASSERT_FALSE(fs::exists(started)) << "a run without a frame is removed";
  for (const char* const frames : {"", "frame,t_s\n"}) {  // killed, so that nothing was removed
    fs::create_directories(started);
    (void)folder.write("run/frames.csv", frames);
    EXPECT_EQ(error_of<std::runtime_error>([&] { NewFolder again(started); }), "no error") << frames;
  }
  (void)folder.write("run/frames.csv", "frame,t_s\n0,0\n");
  EXPECT_EQ(error_of<std::runtime_error>([&] { NewFolder again(started); }),
            started.string() + " holds a run already: choose another --out, or replace it with --force");
  EXPECT_EQ(folder.read("run/frames.csv"), "frame,t_s\n0,0\n");
}

class Replacing : public testing::Test {
 protected:
  /// Returns why `folder` is not replaced, and checks that everything is still there.
  std::string refusal(const fs::path& folder) {
    std::string error = error_of<std::runtime_error>([&] { remove_run(folder); });
    EXPECT_EQ(read_run(run_).frames.size(), 2U) << "the run was changed";
    return error;
  }

  const TemporaryFolder temporary_;
  const fs::path run_ = make_run(temporary_, "run", 2);
};

TEST_F(Replacing, ARunIsRemovedCompletely) {
  (void)temporary_.write("run/report.html", "");
  (void)temporary_.write("run/lower/000001.png.part", "");
  check_replaceable(run_);
  EXPECT_EQ(read_run(run_).frames.size(), 2U) << "the check alone changes nothing";
  remove_run(run_);
  EXPECT_FALSE(fs::exists(run_));
  remove_run(run_);  // does nothing for a missing folder
  fs::create_directories(run_);
  remove_run(run_);  // nor for an empty folder
  EXPECT_TRUE(fs::exists(run_));
}

TEST_F(Replacing, NothingElseIsRemoved) {
  const fs::path link = temporary_.path() / "link";
  fs::create_directory_symlink(run_, link);
  for (const char* const end : {"", "/"}) EXPECT_THAT(refusal(link.string() + end), HasSubstr("it is a link"));

  fs::create_directories(temporary_.path() / "thesis");
  (void)temporary_.write("thesis/thesis.tex", "years of work");
  EXPECT_THAT(refusal(temporary_.path() / "thesis"), HasSubstr("it is no run of twocone"));
  EXPECT_EQ(temporary_.read("thesis/thesis.tex"), "years of work");
  EXPECT_THAT(refusal(temporary_.path() / "thesis" / "thesis.tex"), HasSubstr("it is no folder"));

  const fs::path before = fs::current_path();
  fs::current_path(run_ / "lower");
  for (const char* const working : {"..", "../"}) EXPECT_THAT(refusal(working), HasSubstr("works in it"));
  fs::current_path(run_);
  for (const char* const working : {".", "./"}) EXPECT_THAT(refusal(working), HasSubstr("works in it"));
  fs::current_path(before);

  const RunLock lock(run_);
  EXPECT_THAT(refusal(run_), HasSubstr("is being written by another program"));
}

TEST_F(Replacing, AFileOfSomebodyElseKeepsTheWholeRun) {
  for (const char* const name : {"run/notes.txt", "run/lower/best.png", "run/lower/000000.txt"}) {
    const fs::path file = temporary_.write(name, "");
    EXPECT_THAT(refusal(run_),
                AllOf(HasSubstr(file.string()), HasSubstr("does not belong to a run; move it away first")));
    fs::remove(file);
  }
  fs::create_symlink("/etc/passwd", run_ / "methods");
  EXPECT_THAT(refusal(run_), HasSubstr("methods does not belong to a run"));
}

}  // namespace
}  // namespace twocone::runlog
