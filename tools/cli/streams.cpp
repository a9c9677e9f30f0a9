// SPDX-License-Identifier: Apache-2.0
#include "cli/streams.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>

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

}  // namespace

void silence_libraries() {
#if !defined(__SANITIZE_ADDRESS__)  // whose reports go there
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC), own = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  if (nowhere >= 0 && own >= 0 && dup2(nowhere, STDERR_FILENO) >= 0) messages = own;
  if (nowhere >= 0) close(nowhere);
#endif
}

bool messages_go_to_terminal() { return isatty(messages) != 0; }

void say(const std::string& text) {
  const std::string shown = hexmesh::printable(text);
  for (std::size_t done = 0; done < shown.size();) {
    const ssize_t put = write(messages, shown.data() + done, shown.size() - done);
    if (put < 0 && errno != EINTR) return;
    if (put > 0) done += static_cast<std::size_t>(put);
  }
}

void print(const std::string& text) { hexmesh::write_standard_output(hexmesh::printable(text)); }

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
