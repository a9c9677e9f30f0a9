// SPDX-License-Identifier: Apache-2.0
// What a run says while it takes long, and what it makes of words that it does not know.
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>

#include "cli/nearest_word.h"
#include "cli/progress.h"
#include "cli/streams.h"

namespace test_progress {

using namespace hextools;

/// What is written to standard error while it lives.
class Errors {
public:
  Errors() : before_(dup(STDERR_FILENO)) {
    if (pipe(ends_.data()) != 0) std::abort();
    dup2(ends_[1], STDERR_FILENO);
  }
  ~Errors() { end(); }
  void wait_for_some() const {
    for (int n = 0, bytes = 0; n < 6000 && bytes == 0; ++n) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      ioctl(ends_[0], FIONREAD, &bytes);
    }
  }
  std::string end() {
    if (before_ < 0) return {};
    dup2(before_, STDERR_FILENO);
    close(before_);
    close(ends_[1]);
    before_ = -1;
    std::string out;
    std::array<char, 4096> part{};
    for (ssize_t n = 0; (n = read(ends_[0], part.data(), part.size())) > 0;)
      out.append(part.data(), static_cast<std::size_t>(n));
    close(ends_[0]);
    return out;
  }

private:
  std::array<int, 2> ends_{};
  int before_;
};

TEST(Progress, IsToldWhereNothingElseIs) {
  Errors errors;
  {
    const ProgressTeller teller("hextool", {}, 0.1);
    at_work("level 1", 0.25);
    errors.wait_for_some();
  }
  const std::string told = errors.end();
  EXPECT_NE(told.find("hextool: level 1; 25 % in "), std::string::npos) << told;
  EXPECT_EQ(told.find('\r'), std::string::npos) << "a line that is written over, and no terminal";
  EXPECT_EQ(told.back(), '\n');
}

TEST(Progress, IsNotToldWhereNobodyAsksForIt) {
  CommonOptions quiet, never;
  quiet.quiet = true;
  never.progress = "never";
  for (const CommonOptions& options : {quiet, never}) {
    Errors errors;
    {
      const ProgressTeller teller("hextool", options, 0.01);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_EQ(errors.end(), "");
  }
}

TEST(Progress, SilenceBeginsWithTheLastMessage) {
  Errors errors;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const double before = seconds_of_silence();
  EXPECT_GE(before, 0.2);
  double after = before;
  for (int n = 0; n < 50 && after >= before; ++n) {  // a busy machine may be as slow
    say("message\n");
    after = seconds_of_silence();
  }
  EXPECT_LT(after, before);
}

TEST(Progress, TellsThePartAndTheTimeLeftWhereTheyAreKnown) {
  EXPECT_EQ(work_line("reading 'x'", 12, {}, {}), "reading 'x'; in 12 s");
  EXPECT_EQ(work_line("level 1", 12, 0.4, 17.2), "level 1; 40 % in 12 s, about 18 s left");
}

TEST(NearestWord, IsOneWithFewEdits) {
  EXPECT_EQ(edit_distance("build", "biuld"), 1) << "a swap";
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(nearest_word("biuld", {"check", "build", "info"}), "build");
  EXPECT_EQ(nearest_word("--verion", {"--version", "--view"}), "--version");
  EXPECT_EQ(nearest_word("solve", {"check", "build", "info"}), "");
}

}  // namespace test_progress
