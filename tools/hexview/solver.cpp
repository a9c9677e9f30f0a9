// SPDX-License-Identifier: Apache-2.0
#include "solver.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "cli/child_process.h"
#include "cli/streams.h"
#include "hexmesh/core/error.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

/// The one beside this program, else one on the PATH.
std::string path_of_hexsolve() {
  std::error_code failed;
  const std::filesystem::path beside =
      std::filesystem::read_symlink("/proc/self/exe", failed).replace_filename("hexsolve");
  return !failed && access(beside.c_str(), X_OK) == 0 ? beside.string() : "hexsolve";
}

/// @param input, output  become its standard input and output; -1: none
pid_t begin(std::vector<std::string> words, int input, int output) {
  words.insert(words.begin(), path_of_hexsolve());
  pid_t process = 0;
  if (const int failed = begin_program(words, {input, output, file_of_messages()}, process); failed != 0)
    throw Error(ErrorKind::output, fmt::format("cannot run '{}': {}, expected hexsolve beside hexview or on the PATH",
                                               words.front(), std::strerror(failed)));
  return process;
}

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error(ErrorKind::output, fmt::format("cannot talk to hexsolve: {}", std::strerror(errno)));
  return ends;
}

}  // namespace

int run_hexsolve(std::vector<std::string> arguments) { return wait_for_program(begin(std::move(arguments), -1, -1)); }

Solver::Solver(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--stream=nodes", "--steer", "-"});
  const auto [commands_from, commands_to] = make_pipe();
  const auto [frames_from, frames_to] = make_pipe();
  frames_ = frames_from;
  commands_ = commands_to;
  fcntl(frames_, F_SETFL, O_NONBLOCK);
  fcntl(commands_, F_SETFL, O_NONBLOCK);
  process_ = begin(std::move(arguments), commands_from, frames_to);
  close(commands_from);
  close(frames_to);
}

Solver::~Solver() {
  if (process_ == 0) return;
  kill(process_, SIGTERM);
  wait();
}

bool Solver::send(const std::string& command) {
  if (commands_ < 0) return false;
  const std::string line = command + "\n";
  if (write(commands_, line.data(), line.size()) >= 0) return true;  // short, so whole or not at all
  if (errno == EPIPE) close(std::exchange(commands_, -1));
  return false;
}

void Solver::send_for(double time, const std::string& command) {
  later_ = std::max(later_, time);
  send(fmt::format("at {} {}", time, command));
}

bool Solver::read_more() {
  std::array<char, 65536> buffer{};
  while (frames_ >= 0) {
    const ssize_t count = read(frames_, buffer.data(), buffer.size());
    if (count > 0) {
      bytes_.append(buffer.data(), static_cast<std::size_t>(count));
      return true;
    }
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) return false;
    close(frames_);
    frames_ = -1;
  }
  return false;
}

bool Solver::take_head() {
  const std::size_t end = bytes_.find("\n\n");
  if (end == std::string::npos) return false;
  if (std::sscanf(bytes_.c_str(), "hexstream 1\nnodes %zu\n", &num_nodes_) != 1 || num_nodes_ == 0)
    throw Error(ErrorKind::output, "hexsolve sends no stream of nodes, expected one of this version beside hexview");
  bytes_.erase(0, end + 2);
  return true;
}

std::optional<Frame> Solver::newest() {
  std::optional<Frame> out;
  const auto take = [&] {
    if (num_nodes_ == 0 && !take_head()) return;
    const std::size_t values = 3 * num_nodes_, size = sizeof(double) + values * sizeof(float);
    const std::size_t whole = bytes_.size() / size;
    if (whole == 0) return;
    const char* last = bytes_.data() + (whole - 1) * size;
    out.emplace();
    out->displacement.resize(values);
    std::memcpy(&out->time, last, sizeof(double));
    time_ = out->time;
    std::memcpy(out->displacement.data(), last + sizeof(double), values * sizeof(float));
    num_frames_ += whole;
    bytes_.erase(0, whole * size);
  };
  while (read_more()) take();
  return out;
}

int Solver::wait() {
  // One whose reader leaves ends too, but says so; it alone ends one with commands for later, behind which `end` waits.
  if (time_ >= later_ && frames_ >= 0 && send("end")) {
    fcntl(frames_, F_SETFL, 0);
    while (read_more()) bytes_.clear();
  }
  for (int* file : {&commands_, &frames_})
    if (*file >= 0) close(std::exchange(*file, -1));
  return wait_for_program(std::exchange(process_, 0));
}

}  // namespace hextools
