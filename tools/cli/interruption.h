// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <signal.h>

#include <array>

namespace hextools {

/// While it lives, the first signal that asks the run to end (Ctrl-C, SIGTERM, SIGHUP) is only noted, so that what
/// there is can be kept; the next one ends the run as ever. At most one at a time.
class Interruption {
public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// The one that came, 0 if none has.
  int signal() const;

private:
  std::array<struct sigaction, 3> before_;
};

}  // namespace hextools
