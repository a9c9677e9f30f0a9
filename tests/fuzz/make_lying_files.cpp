// SPDX-License-Identifier: Apache-2.0
// Valid files that lie, for try_lying_files.py: make_lying_files GOOD FOLDER, of a good lattice or result.
#include <fmt/format.h>

#include <fstream>

#include "support/lying_files.h"

using namespace testing_support;
namespace fs = std::filesystem;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const fs::path good = argv[1], folder = argv[2];
  fs::create_directories(folder);
  std::vector<Lie> lies = lies_about(good);
  for (Lie& lie : larger_lies(good)) lies.push_back(std::move(lie));
  if (good.extension() == ".hexresult")
    for (Lie& lie : lies_in_reports()) lies.push_back(std::move(lie));
  std::ofstream list(folder / "names");
  for (std::size_t n = 0; n < lies.size(); ++n) {
    const std::string name = fmt::format("{:04}{}", n, good.extension().string());
    fs::copy_file(good, folder / name, fs::copy_options::overwrite_existing);
    lies[n].tell(folder / name);
    list << name << '\t' << (lies[n].must_be_refused ? "refused" : "sane") << '\t' << lies[n].name.substr(0, 120)
         << '\n';
  }
  return list ? 0 : 1;
}
