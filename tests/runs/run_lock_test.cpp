// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run_lock.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/files/file_error.h"
#include "apps/runs/new_folder.h"
#include "apps/runs/replace_run.h"
#include "apps/runs/run.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/run_yaml.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::TemporaryFolder;

std::string error_of(const auto& call) {
  try {
    call();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

/// A run of `frames` frames that nobody writes into any more.
fs::path make_run(const TemporaryFolder& folder, const std::string& name, int frames) {
  RunFolder run(folder.path() / name);
  for (int frame = 0; frame < frames; ++frame) {
    FrameRecord record;
    record.frame.frame = std::uint64_t(frame);
    run.add(record, Image{1, 1, PixelFormat::kRgb8, {1, 2, 3}}, Image{1, 1, PixelFormat::kRgb8, {4, 5, 6}});
  }
  RunInfo info;
  info.method = "full";
  write_run_yaml(run.path(), info, files::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml"),
                 TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml");
  return run.path();
}

TEST(RunLock, ASecondWriterIsRefusedByNameUntilTheFirstHasEnded) {
  const TemporaryFolder folder;
  {
    const RunLock lock(folder.path());
    EXPECT_EQ(error_of([&] { RunLock second(folder.path()); }),
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
  EXPECT_THAT(error_of([&] { RunLock second(folder.path()); }), HasSubstr(std::to_string(child)));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(error_of([&] { RunLock second(folder.path()); }), "no error");
}

// Catches two programs that hold the lock of one folder, since the file of one is not there any more.
TEST(RunLock, IsOfTheFolderThatIsThereNow) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  fs::create_directories(run);
  const RunLock lock(run);
  fs::rename(run, folder.path() / "old");
  fs::create_directories(run);
  EXPECT_TRUE(RunLock::try_take(run));
}

// What was lost: localise of a run that still went on, a second localise, and --force on either.
TEST(RunLock, NobodyElseWritesWhileARunGoesOn) {
  const TemporaryFolder folder;
  const fs::path path = make_run(folder, "run", 1);
  const RunLock lock(path);
  const std::string held = "is being written by another program";
  EXPECT_THAT(error_of([&] { (void)localise(path, Method::kPaper, [](double) {}); }), HasSubstr(held));
  EXPECT_THAT(error_of([&] { RunFolder again(path); }), HasSubstr(held));
  EXPECT_THAT(error_of([&] { remove_run(path); }), HasSubstr(held));
  EXPECT_EQ(read_run(path).frames.size(), 1U) << "it can be read all the while";
}

TEST(NewFolder, GoesAgainUnlessItIsKept) {
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
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "mine"), {}), 1) << "something of it is left";
  {
    NewFolder made(folder.path() / "run");
    made.keep();
  }
  EXPECT_TRUE(fs::exists(folder.path() / "run" / "upper"));
}

// A start that failed barred the next one.
TEST(NewFolder, AStartWithoutAFrameIsNotInTheWayButARunIs) {
  const TemporaryFolder folder;
  const fs::path started = make_run(folder, "run", 0);
  ASSERT_FALSE(fs::exists(started)) << "a run without a frame has gone by itself";
  for (const char* const frames : {"", "frame,t_s\n"}) {  // killed, so that nothing could go
    fs::create_directories(started);
    (void)folder.write("run/frames.csv", frames);
    EXPECT_EQ(error_of([&] { NewFolder again(started); }), "no error") << frames;
  }
  (void)folder.write("run/frames.csv", "frame,t_s\n0,0\n");
  EXPECT_EQ(error_of([&] { NewFolder again(started); }),
            started.string() + " holds a run already: choose another --out, or replace it with --force");
  EXPECT_EQ(folder.read("run/frames.csv"), "frame,t_s\n0,0\n");
}

class Replacing : public testing::Test {
 protected:
  /// Why `folder` is not replaced; everything is still there.
  std::string refusal(const fs::path& folder) {
    std::string error = error_of([&] { remove_run(folder); });
    EXPECT_EQ(read_run(run_).frames.size(), 2U) << "the run was touched";
    return error;
  }

  const TemporaryFolder temporary_;
  const fs::path run_ = make_run(temporary_, "run", 2);
};

TEST_F(Replacing, ARunGoesWhole) {
  (void)temporary_.write("run/report.html", "");
  (void)temporary_.write("run/lower/000001.png.part", "");
  check_replaceable(run_);
  EXPECT_EQ(read_run(run_).frames.size(), 2U) << "the check alone changes nothing";
  remove_run(run_);
  EXPECT_FALSE(fs::exists(run_));
  remove_run(run_);  // nothing there: nothing to do
  fs::create_directories(run_);
  remove_run(run_);  // nor in an empty folder
  EXPECT_TRUE(fs::exists(run_));
}

TEST_F(Replacing, NothingElseGoes) {
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
    EXPECT_THAT(refusal(run_), AllOf(HasSubstr(file.string()), HasSubstr("is not of a run; take it away first")));
    fs::remove(file);
  }
  fs::create_symlink("/etc/passwd", run_ / "methods");
  EXPECT_THAT(refusal(run_), HasSubstr("methods is not of a run"));
}

}  // namespace
}  // namespace twocone::runs
