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
constexpr milliseconds turn(100);  ///< between two looks at whether the run is to end
constexpr const char* all_commands =
    "grab POINT X Y Z [REACH], release [POINT], pause, resume, pace RATE or end, after 'at SECONDS' if not at once";

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
      file_(name == "-" ? STDIN_FILENO : open(name.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
  if (file_ < 0) throw Error(ErrorKind::input, fmt::format("cannot read '{}': {}", name_, std::strerror(errno)));
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
      console_.warning(fmt::format("{}: it ends while the motion is paused, which goes on", name_));
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
  if (file_ < 0) {
    if (wait.count() > 0) poll(nullptr, 0, static_cast<int>(wait.count()));
    return;
  }
  std::array<char, 4096> buffer{};
  for (int timeout = static_cast<int>(wait.count());; timeout = 0) {
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
  for (std::size_t end = bytes_.find('\n'); end != std::string::npos; end = bytes_.find('\n')) {
    take_line(bytes_.substr(0, end));
    bytes_.erase(0, end + 1);
  }
  if ((is_at_end && !bytes_.empty()) || bytes_.size() > longest_line) take_line(std::exchange(bytes_, ""));
}

void Steering::take_line(std::string line) {
  Command command{std::move(line), {}, {}};
  command.words = words_of(command.line);
  if (command.words.empty() || command.words[0].starts_with('#')) return;
  command.time = take_time(command.words);
  commands_.push_back(std::move(command));
}

void Steering::carry_out(hexsolver::Motion& motion) {
  const auto is_due = [&] { return motion.time() >= commands_.front().time.value_or(0); };
  while (!commands_.empty() && !ends_ && is_due()) {
    obey(commands_.front(), motion);
    commands_.pop_front();
  }
  // What waits for a time that does not pass while it is paused would wait for ever.
  if (is_paused_ && !commands_.empty() && !is_due()) {
    console_.warning(fmt::format("{}: '{}' is asked of a later time while the motion is paused, which goes on", name_,
                                 commands_.front().line));
    is_paused_ = false;
  }
}

void Steering::obey(const Command& command, hexsolver::Motion& motion) {
  if (const std::string why = refusal(command.words, motion); !why.empty())
    console_.warning(fmt::format("{}: '{}' {}", name_, command.line.substr(0, longest_line), why));
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
