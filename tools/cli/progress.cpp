// SPDX-License-Identifier: Apache-2.0
#include "cli/progress.h"

#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <new>
#include <system_error>

#include "cli/streams.h"
#include "hexmesh/core/printable.h"
#include "hexmesh/file/temporary_file.h"

namespace hextools {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

/// Where the run is, and where it was when a part of it was first known.
struct Work {
  std::string what = "at work";
  std::optional<double> part;
  double part_at_first = 0;
  Clock::time_point first;
};

std::mutex work_mutex;
Work work;
const Clock::time_point begin_of_run = Clock::now();

std::optional<double> seconds_left(const Work& now) {
  constexpr double least_part = 0.02, least_seconds = 1;  // before that it is a guess
  if (!now.part) return {};
  const double done = *now.part - now.part_at_first, taken = seconds_since(now.first);
  if (done < least_part || taken < least_seconds) return {};
  return taken * (1 - *now.part) / done;
}

}  // namespace

void at_work(std::string what, std::optional<double> part) {
  what = hexmesh::with_known_names(std::move(what));
  const std::lock_guard lock(work_mutex);
  if (part && (!work.part || *part < *work.part)) {
    work.part_at_first = *part;
    work.first = Clock::now();
  }
  work.what = std::move(what);
  work.part = part;
}

std::string work_line(const std::string& what, double seconds, std::optional<double> part,
                      std::optional<double> seconds_left) {
  std::string out = what + "; ";
  if (part) out += fmt::format("{:.0f} % ", 100 * *part);
  out += fmt::format("in {:.0f} s", seconds);
  if (seconds_left) out += fmt::format(", about {:.0f} s left", std::ceil(*seconds_left));
  return out;
}

ProgressTeller::ProgressTeller(std::string tool, const CommonOptions& options, double seconds_of_silence)
    : tool_(std::move(tool)),
      silence_(seconds_of_silence),
      writes_over_(options.progress == "auto" && messages_go_to_terminal()) {
  if (options.quiet || options.progress == "never") return;
  // Signals are for the thread that works.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    thread_ = std::thread([this] { tell(); });
  } catch (const std::system_error&) {  // a run without progress is better than none
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

ProgressTeller::~ProgressTeller() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ends_.notify_all();
  thread_.join();
  if (writes_over_) write_over("");
}

void ProgressTeller::tell() {
  constexpr double between_lines = 0.5;
  const auto wait_for = [&](std::unique_lock<std::mutex>& lock, double seconds) {
    return ends_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return ended_; });
  };
  std::unique_lock lock(mutex_);
  for (double wait = writes_over_ ? between_lines : silence_; !wait_for(lock, wait);) {
    try {
      const double left = silence_ - seconds_of_silence();
      const std::string now = line();
      if (writes_over_)
        write_over(now);
      else if (left <= 0 && !now.empty())
        say(now + "\n");
      if (!writes_over_) wait = left > 0 ? left : silence_;
    } catch (const std::bad_alloc&) {  // the run may still do
    }
  }
}

std::string ProgressTeller::line() const {
  const std::lock_guard lock(work_mutex);
  if (work.what.empty()) return "";
  return fmt::format(
      "{}: {}", tool_,
      work_line(hexmesh::printable_line(work.what), seconds_since(begin_of_run), work.part, seconds_left(work)));
}

}  // namespace hextools
