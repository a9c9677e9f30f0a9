// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/tool.h"
#include "hexsolver/dynamics/motion.h"

namespace hextools {

/// A motion under the commands of a viewer, which come line by line while it is solved: "Steering" in FORMATS.md.
class Steering {
public:
  /// @param name           of a file or a pipe; "-" is standard input
  /// @param num_points     of the picture surface
  /// @param is_to_end      whether the run is to end, asked while it waits
  /// @throws Error{input} where it cannot be read
  Steering(const std::string& name, std::size_t num_points, const Console& console, std::function<bool()> is_to_end);
  ~Steering();
  Steering(const Steering&) = delete;
  Steering& operator=(const Steering&) = delete;

  /// Carries out what has come, and waits where it is asked to.
  hexsolver::NextStep next_step(hexsolver::Motion& motion);

  void end() { ends_ = true; }  ///< as a command does, before the next step

  /// What was carried out, each with its time: the same commands at the same times.
  const std::string& record() const { return record_; }

private:
  using Clock = std::chrono::steady_clock;
  struct Command {
    std::string line;            ///< as it came
    std::optional<double> time;  ///< of the motion, not before [s]
    std::vector<std::string> words;
  };
  void receive(std::chrono::milliseconds wait);
  void take_lines(bool is_at_end);
  void carry_out(hexsolver::Motion& motion);
  void take_line(std::string line);
  void warn(const std::string& what);  ///< the first ones
  void obey(const Command& command, hexsolver::Motion& motion);
  std::string refusal(const std::vector<std::string>& words, hexsolver::Motion& motion);
  std::chrono::milliseconds time_left(double time);

  std::string name_;
  std::size_t num_points_;
  const Console& console_;
  std::function<bool()> is_to_end_;
  int file_ = -1;      ///< -1: nothing more comes
  std::string bytes_;  ///< of the line that comes
  bool is_first_line_ = true;
  int warnings_ = 0;
  std::deque<Command> commands_;
  bool is_paused_ = false, ends_ = false;
  double pace_ = 0;                         ///< seconds of the motion in one [1]; 0: as fast as it can
  std::optional<Clock::time_point> since_;  ///< the pace holds
  double since_time_ = 0;                   ///< of the motion then [s]
  std::string record_;
};

}  // namespace hextools
