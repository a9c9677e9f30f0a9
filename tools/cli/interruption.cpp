// SPDX-License-Identifier: Apache-2.0
#include "cli/interruption.h"

#include <csignal>

namespace hextools {
namespace {

constexpr std::array<int, 3> ending = {SIGINT, SIGTERM, SIGHUP};

volatile std::sig_atomic_t noted = 0;
std::array<struct sigaction, 3>* actions_before = nullptr;

void restore() {
  for (std::size_t n = 0; n < ending.size(); ++n) sigaction(ending[n], &(*actions_before)[n], nullptr);
}

extern "C" void note(int number) {
  noted = number;
  restore();
}

}  // namespace

Interruption::Interruption() : before_() {
  noted = 0;
  actions_before = &before_;
  struct sigaction action {};
  action.sa_handler = note;
  sigemptyset(&action.sa_mask);
  for (const int number : ending) sigaddset(&action.sa_mask, number);
  for (std::size_t n = 0; n < ending.size(); ++n) sigaction(ending[n], nullptr, &before_[n]);
  for (std::size_t n = 0; n < ending.size(); ++n)
    if (before_[n].sa_handler != SIG_IGN) sigaction(ending[n], &action, nullptr);  // nohup
}

Interruption::~Interruption() {
  restore();
  actions_before = nullptr;
}

int Interruption::signal() const { return noted; }

}  // namespace hextools
