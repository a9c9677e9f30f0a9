// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "cli/tool.h"

namespace hextools {

/// What the run is at from now on, told by a ProgressTeller if there is one. Empty: nothing that takes its time.
/// @param part  of the run that is done [0, 1], where it is known: the time left follows
void at_work(std::string what, std::optional<double> part = {});

/// "level 1, Newton step 4; 40 % in 12 s, about 18 s left".
/// @param seconds  since the run began
std::string work_line(const std::string& what, double seconds, std::optional<double> part,
                      std::optional<double> seconds_left);

/// Tells what a run is at while it takes long, from a thread of its own: on a terminal in one line that is written
/// over, elsewhere in a line of its own where nothing was said for a while. Not with --quiet or --progress never.
class ProgressTeller {
public:
  explicit ProgressTeller(std::string tool, const CommonOptions& options, double seconds_of_silence = 10);
  ~ProgressTeller();
  ProgressTeller(const ProgressTeller&) = delete;
  ProgressTeller& operator=(const ProgressTeller&) = delete;

private:
  void tell();
  std::string line() const;

  std::string tool_;
  double silence_;
  bool writes_over_;
  std::mutex mutex_;
  std::condition_variable ends_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace hextools
