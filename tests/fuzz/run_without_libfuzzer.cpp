// SPDX-License-Identifier: Apache-2.0
// Where the compiler has no libFuzzer: the corpus, then that many random changes of it, the same every time.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

/// One of: a changed byte, a cut, a piece repeated, a number made huge.
void change(Bytes& bytes, std::mt19937& random) {
  if (bytes.empty()) return;
  const auto place = [&] { return static_cast<std::ptrdiff_t>(random() % bytes.size()); };
  const std::ptrdiff_t at = place();
  switch (random() % 4) {
    case 0:
      bytes[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(random());
      break;
    case 1:
      bytes.resize(static_cast<std::size_t>(at));
      break;
    case 2: {
      const Bytes piece(bytes.begin() + at, bytes.begin() + std::min<std::ptrdiff_t>(at + 16, std::ssize(bytes)));
      bytes.insert(bytes.begin() + place(), piece.begin(), piece.end());
      break;
    }
    default:
      for (std::ptrdiff_t n = at; n < std::min<std::ptrdiff_t>(at + 4, std::ssize(bytes)); ++n)
        bytes[static_cast<std::size_t>(n)] =
            bytes[static_cast<std::size_t>(n)] >= '0' && bytes[static_cast<std::size_t>(n)] <= '9' ? '9' : 0xff;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: {} CORPUS RUNS\n", argv[0]);
    return 2;
  }
  std::vector<std::filesystem::path> names;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) names.push_back(entry.path());
  std::sort(names.begin(), names.end());
  std::vector<Bytes> corpus;
  for (const auto& name : names) {
    std::ifstream file(name, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    LLVMFuzzerTestOneInput(corpus.back().data(), corpus.back().size());
  }
  if (corpus.empty()) {
    fmt::print(stderr, "{}: no corpus, expected files\n", argv[1]);
    return 1;
  }
  std::mt19937 random(1);
  const int runs = std::stoi(argv[2]);
  for (int n = 0; n < runs; ++n) {
    Bytes bytes = corpus[random() % corpus.size()];
    for (std::uint32_t changes = 1 + random() % 4; changes > 0; --changes) change(bytes, random);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  fmt::print("{} files and {} changed ones\n", corpus.size(), runs);
  return 0;
}
