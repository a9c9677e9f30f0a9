// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/dataset_compare.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "hdf5.h"

namespace hexmesh {
namespace {

class DatasetFile {
public:
  explicit DatasetFile(const std::filesystem::path& path) : file_(path, "HDF5") {
    for (const std::string& name : file_.dataset_names())
      if (name != "/history" && name != "/costs") names_.insert(name);
  }

  const std::set<std::string>& names() const noexcept { return names_; }

  struct Values {
    hdf5::Shape shape;
    std::vector<std::string> texts;
    std::vector<double> numbers;  ///< none of texts
    bool is_text = false;
  };
  Values read(const std::string& name) const {
    Values v;
    v.is_text = file_.is_text(name);
    if (v.is_text)
      v.texts = file_.read_strings(name);
    else
      v.numbers = file_.read_any_numbers(name, v.shape);
    return v;
  }

private:
  hdf5::Reader file_;
  std::set<std::string> names_;
};

}  // namespace

std::vector<DatasetDifference> compare_datasets(const std::filesystem::path& first,
                                                const std::filesystem::path& second) {
  const DatasetFile a(first), b(second);
  std::vector<DatasetDifference> out;
  for (const std::string& name : a.names())
    if (!b.names().contains(name)) out.push_back({name, "is only in the first"});
  for (const std::string& name : b.names())
    if (!a.names().contains(name)) out.push_back({name, "is only in the second"});
  for (const std::string& name : a.names()) {
    if (!b.names().contains(name)) continue;
    const DatasetFile::Values x = a.read(name), y = b.read(name);
    if (x.shape != y.shape || x.is_text != y.is_text || x.texts.size() != y.texts.size()) {
      out.push_back({name, "has another shape or type"});
    } else if (x.is_text) {
      if (x.texts != y.texts) out.push_back({name, "has another text"});
    } else if (!x.numbers.empty() &&
               std::memcmp(x.numbers.data(), y.numbers.data(), sizeof(double) * x.numbers.size()) != 0) {
      DatasetDifference d{name, "has other numbers"};
      for (std::size_t n = 0; n < x.numbers.size(); ++n) {
        const double difference = std::abs(x.numbers[n] - y.numbers[n]);
        if (!(difference <= d.largest)) d.largest = difference;
      }
      out.push_back(std::move(d));
    }
  }
  return out;
}

}  // namespace hexmesh
