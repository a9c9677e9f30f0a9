// SPDX-License-Identifier: Apache-2.0
#include "cli/streams.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <mutex>

#include "hexmesh/core/error.h"
#include "hexmesh/core/printable.h"
#include "hexmesh/file/atomic_file.h"

namespace hextools {
namespace {

/// A standard stream that is closed would be the next file that is opened, and messages would go into it. Before
/// main(), because libraries open files too. The wrong direction makes each use an error, as it would be of a closed
/// one.
[[gnu::constructor(102)]] void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      if (open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) _exit(6);
}

int messages = STDERR_FILENO;
std::mutex one_at_a_time;
std::string line_on_terminal;  ///< by write_over()
bool is_printing = false;      ///< onto a terminal: what stands there is not to be written over
std::chrono::steady_clock::time_point last_said = std::chrono::steady_clock::now();

void put(const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written = write(messages, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno != EINTR) return;
    if (written > 0) done += static_cast<std::size_t>(written);
  }
}

void clear_line() {
  if (!line_on_terminal.empty()) put("\r\x1b[K");
  line_on_terminal.clear();
}

/// Of UTF-8.
std::string first_characters(const std::string& text, std::size_t count) {
  std::size_t bytes = 0;
  for (; bytes < text.size(); ++bytes)
    if ((static_cast<unsigned char>(text[bytes]) & 0xC0U) != 0x80U && count-- == 0) break;
  return text.substr(0, bytes);
}

/// Of the terminal: a line that is longer could not be written over.
std::size_t columns() {
  winsize size{};
  return ioctl(messages, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col - 1U : 79U;
}

}  // namespace

void silence_libraries() {
#if !defined(__SANITIZE_ADDRESS__)  // whose reports go there
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC), own = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  if (nowhere >= 0 && own >= 0 && dup2(nowhere, STDERR_FILENO) >= 0) messages = own;
  if (nowhere >= 0) close(nowhere);
#endif
}

int file_of_messages() { return messages; }

bool messages_go_to_terminal() { return isatty(messages) != 0; }

void say(const std::string& text) {
  const std::string shown = hexmesh::printable(text);
  const std::lock_guard lock(one_at_a_time);
  clear_line();
  put(shown);
  last_said = std::chrono::steady_clock::now();
}

void write_over(const std::string& line) {
  std::string shown =
      first_characters(hexmesh::printable_line(line), columns());  // before the lock, as it takes memory
  const std::lock_guard lock(one_at_a_time);
  clear_line();
  if (is_printing) return;
  line_on_terminal.swap(shown);
  put(line_on_terminal);
}

double seconds_of_silence() {
  const std::lock_guard lock(one_at_a_time);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - last_said).count();
}

void print(const std::string& text) {
  const std::lock_guard lock(one_at_a_time);
  clear_line();
  is_printing = is_printing || isatty(STDOUT_FILENO) != 0;
  hexmesh::write_standard_output(hexmesh::printable(text));
}

void print_data(const std::string& text) {
  if (isatty(STDOUT_FILENO))
    print(text);
  else
    hexmesh::write_standard_output(text);
}

void flush_standard_output() {
  std::cout.flush();
  if (std::fflush(stdout) != 0 || !std::cout || std::ferror(stdout) != 0)
    throw hexmesh::Error(hexmesh::ErrorKind::output,
                         fmt::format("cannot write standard output: {}", std::strerror(errno)));
}

}  // namespace hextools
