// SPDX-License-Identifier: Apache-2.0
#include "steering.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "cli/parse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/atomic_file.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::NextStep;
using std::chrono::milliseconds;

constexpr std::size_t longest_line = 1000;
constexpr std::size_t most_waiting = 10'000;  ///< commands; what comes beyond stays where it is
constexpr int most_warnings = 20;             ///< of commands
constexpr milliseconds turn(100);             ///< between two looks at whether the run is to end
constexpr const char* all_commands =
    "grab POINT X Y Z [REACH], release [POINT], pause, resume, pace RATE or end, after 'at SECONDS' if not at once";

/// Waits for a writer where it is a pipe, as every reader of one does, but not for what is written.
int open_commands(const std::string& name, const std::string& told, const std::function<bool()>& is_to_end) {
  if (name == "-") return STDIN_FILENO;
  std::error_code failed;
  if (std::filesystem::is_directory(name, failed))
    throw Error(ErrorKind::input, fmt::format("'{}' is a folder, expected a file or a pipe with commands", told));
  int file = -1;
  errno = EINTR;
  while (file < 0 && errno == EINTR && !is_to_end()) file = open(name.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0 && errno != EINTR)
    throw Error(ErrorKind::input, fmt::format("cannot read '{}': {}", told, std::strerror(errno)));
  if (file >= 0) fcntl(file, F_SETFL, O_NONBLOCK);
  return file;
}

std::optional<double> finite(const std::string& word) {
  const auto value = parse_number<double>(word);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

}  // namespace

Steering::Steering(const std::string& name, std::size_t num_points, const Console& console,
                   std::function<bool()> is_to_end)
    : name_(hexmesh::input_name(name)),
      num_points_(num_points),
      console_(console),
      is_to_end_(std::move(is_to_end)),
      file_(open_commands(name, name_, is_to_end_)) {
  if (num_points_ == 0)
    throw Error(ErrorKind::input,
                "--steer is of a lattice without a surface, expected one whose points can be grabbed");
}

Steering::~Steering() {
  if (file_ > STDIN_FILENO) close(file_);
}

NextStep Steering::next_step(hexsolver::Motion& motion) {
  receive(milliseconds(0));
  carry_out(motion);
  while (!ends_) {
    const milliseconds left = is_paused_ ? turn : time_left(motion.time());
    if (is_paused_ && file_ < 0) {
      warn("it ends while the motion is paused, which goes on");
      is_paused_ = false;
      continue;
    }
    if (left.count() <= 0) return NextStep::take;
    if (is_to_end_()) return NextStep::interrupt;
    receive(std::min(left, turn));
    carry_out(motion);
  }
  record_ += fmt::format("at {} end\n", motion.time());
  return NextStep::end;
}

/// How long the pace lets wait for the next step. A motion that is late does not catch up.
milliseconds Steering::time_left(double time) {
  if (pace_ == 0) return milliseconds(0);
  const auto now = Clock::now();
  if (!since_) {
    since_ = now;
    since_time_ = time;
  }
  const auto due = *since_ + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>((time - since_time_) / pace_));
  if (due <= now) {
    since_ = now;
    since_time_ = time;
  }
  return std::chrono::ceil<milliseconds>(due - now);
}

void Steering::receive(milliseconds wait) {
  if (file_ < 0 || commands_.size() >= most_waiting) {
    if (wait.count() > 0) poll(nullptr, 0, static_cast<int>(wait.count()));
    return;
  }
  constexpr int most_reads = 256;  // what writes without end does not keep the motion from going on
  std::array<char, 4096> buffer{};
  int timeout = static_cast<int>(wait.count());
  for (int reads = 0; reads < most_reads; ++reads, timeout = 0) {
    if (commands_.size() >= most_waiting) return;  // the rest stays where it is
    pollfd of_file{file_, POLLIN, 0};
    if (poll(&of_file, 1, timeout) <= 0) return;
    const ssize_t count = of_file.revents & (POLLIN | POLLHUP) ? read(file_, buffer.data(), buffer.size()) : 0;
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
    if (count > 0) bytes_.append(buffer.data(), static_cast<std::size_t>(count));
    take_lines(count <= 0);
    if (count > 0) continue;
    if (file_ > STDIN_FILENO) close(file_);
    file_ = -1;
    return;
  }
}

void Steering::take_lines(bool is_at_end) {
  std::size_t begin = 0;
  for (std::size_t end = bytes_.find('\n'); end != std::string::npos; end = bytes_.find('\n', begin)) {
    take_line(bytes_.substr(begin, end - begin));
    begin = end + 1;
  }
  bytes_.erase(0, begin);
  if (is_at_end && !bytes_.empty()) take_line(std::exchange(bytes_, ""));
  if (bytes_.size() > longest_line) bytes_.resize(longest_line + 10);  // enough to know that it is too long
}

void Steering::take_line(std::string line) {
  constexpr const char* byte_order_mark = "\xEF\xBB\xBF";
  if (std::exchange(is_first_line_, false) && line.starts_with(byte_order_mark)) line.erase(0, 3);
  if (line.ends_with('\r')) line.pop_back();
  if (line.size() > longest_line)
    return warn(
        fmt::format("a line of more than {} characters, '{}...', is no command", longest_line, line.substr(0, 40)));
  Command command{std::move(line), {}, {}};
  command.words = words_of(command.line);
  if (command.words.empty() || command.words[0].starts_with('#')) return;
  command.time = take_time(command.words);
  commands_.push_back(std::move(command));
}

void Steering::warn(const std::string& what) {
  if (++warnings_ <= most_warnings) console_.warning(fmt::format("{}: {}", name_, what));
  if (warnings_ == most_warnings) console_.warning(fmt::format("{}: what is wrong from here on is not told", name_));
}

void Steering::carry_out(hexsolver::Motion& motion) {
  const auto is_due = [&] { return motion.time() >= commands_.front().time.value_or(0); };
  while (!commands_.empty() && !ends_ && is_due()) {
    obey(commands_.front(), motion);
    commands_.pop_front();
  }
  // What waits for a time that does not pass while it is paused would wait for ever.
  if (is_paused_ && !commands_.empty() && !is_due()) {
    warn(
        fmt::format("'{}' is asked of a later time while the motion is paused, which goes on", commands_.front().line));
    is_paused_ = false;
  }
}

void Steering::obey(const Command& command, hexsolver::Motion& motion) {
  if (const std::string why = refusal(command.words, motion); !why.empty())
    warn(fmt::format("'{}' {}", command.line, why));
  else if (!ends_)
    record_ += fmt::format("at {} {}\n", motion.time(), fmt::join(command.words, " "));
}

/// Carries out a command. @returns what is wrong with it, where it cannot be
std::string Steering::refusal(const std::vector<std::string>& words, hexsolver::Motion& motion) {
  const std::string& verb = words[0];
  std::vector<double> numbers;
  for (std::size_t n = 1; n < words.size(); ++n) {
    const auto value = finite(words[n]);
    if (!value) return fmt::format("has '{}', expected a number", words[n]);
    numbers.push_back(*value);
  }
  const bool names_point =
      (verb == "grab" && numbers.size() >= 4 && numbers.size() <= 5) || (verb == "release" && numbers.size() == 1);
  const double last = static_cast<double>(num_points_) - 1;
  if (names_point && !(numbers[0] >= 0 && numbers[0] <= last && numbers[0] == std::floor(numbers[0])))
    return fmt::format("is of point {}, expected 0 to {}", words[1], last);
  if (verb == "grab" && names_point) {
    const double reach = numbers.size() > 4 ? numbers[4] : 0;
    if (reach < 0) return fmt::format("has a reach of {}, expected one >= 0", words[5]);
    if (!motion.grab(static_cast<std::size_t>(numbers[0]), {numbers[1], numbers[2], numbers[3]}, reach))
      return "is of a point that no cell moves";
  } else if (verb == "release" && (names_point || numbers.empty())) {
    motion.let_go(numbers.empty() ? std::optional<std::size_t>() : static_cast<std::size_t>(numbers[0]));
  } else if (verb == "pace" && numbers.size() == 1 && numbers[0] >= 0) {
    pace_ = numbers[0];
    since_.reset();
  } else if ((verb == "pause" || verb == "resume") && numbers.empty()) {
    is_paused_ = verb == "pause";
    since_.reset();
  } else if (verb == "end" && numbers.empty()) {
    ends_ = true;
  } else {
    return fmt::format("is no command, expected {}", all_commands);
  }
  return "";
}

}  // namespace hextools
