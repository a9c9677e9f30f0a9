// SPDX-License-Identifier: Apache-2.0
#include "lying_files.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "plain_dataset.h"

namespace testing_support {
namespace {

namespace fs = std::filesystem;

class LieMaker {
public:
  using Change = std::function<void(hid_t file)>;
  using ChangeOfValues = std::function<void(Values& values)>;

  void add(const std::string& what, bool must_be_refused, const Change& change) {
    lies_.push_back({what, must_be_refused, [change](const fs::path& path) {
                       const File file(path);
                       change(file.id);
                     }});
  }
  void add_values(const std::string& name, const std::string& what, bool must_be_refused, const ChangeOfValues& change,
                  Keep keep = Keep::as_ours) {
    add(name + " " + what, must_be_refused, [=](hid_t file) {
      Values v = read(file, name);
      if (v.type < 0) return;
      change(v);
      put(file, name, v, keep);
    });
  }
  std::vector<Lie> take() { return std::move(lies_); }

private:
  std::vector<Lie> lies_;
};

void add_storage(LieMaker& lies, const std::string& name, bool is_empty) {
  const auto nothing = [](Values&) {};
  if (!is_empty) {
    lies.add_values(name, "contiguous", true, nothing, Keep::contiguous);
    lies.add_values(name, "compact", true, nothing, Keep::compact);
    lies.add_values(name, "without checksum", true, nothing, Keep::without_checksum);
    lies.add_values(name, "by a foreign filter", true, nothing, Keep::foreign);
  }
  lies.add_values(name, "in another file", true, nothing, Keep::external);
  lies.add(name + " virtual", true, [=](hid_t file) {
    if (const Values v = read(file, name); v.type >= 0) put_virtual(file, name, v);
  });
  const auto in_place = [&](const std::string& what, const LieMaker::Change& change) {
    lies.add(name + " " + what, true, [=](hid_t file) {
      H5Lmove(file, name.c_str(), file, "/elsewhere", H5P_DEFAULT, H5P_DEFAULT);
      change(file);
    });
  };
  in_place("a soft link", [=](hid_t f) { H5Lcreate_soft("/elsewhere", f, name.c_str(), H5P_DEFAULT, H5P_DEFAULT); });
  in_place("a link to itself",
           [=](hid_t f) { H5Lcreate_soft(name.c_str(), f, name.c_str(), H5P_DEFAULT, H5P_DEFAULT); });
  in_place("in a linked file",
           [=](hid_t f) { H5Lcreate_external("good", name.c_str(), f, name.c_str(), H5P_DEFAULT, H5P_DEFAULT); });
  in_place("the root group", [=](hid_t f) { H5Lcreate_hard(f, "/", f, name.c_str(), H5P_DEFAULT, H5P_DEFAULT); });
  in_place("a group", [=](hid_t f) { H5Gclose(H5Gcreate2(f, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)); });
}

void add_shapes(LieMaker& lies, const std::string& name, const Values& good) {
  const bool is_empty = good.bytes.empty();
  const bool is_optional = name == "/costs";
  lies.add(name + " missing", !is_optional, [=](hid_t file) { H5Ldelete(file, name.c_str(), H5P_DEFAULT); });
  lies.add_values(name, "with one more axis", true, [](Values& v) { v.shape.push_back(1); });
  lies.add(name + " that claims 2^33 rows", true, [=](hid_t file) {
    if (const Values v = read(file, name); v.type >= 0) put_claim(file, name, v, hsize_t{1} << 33);
  });
  if (is_empty) return;
  // Of what stands alone another number of rows may be right; points, elements and layers that nothing uses do no harm,
  // and faces that are missing only `hexmesh check` sees.
  const std::set<std::string> alone = {"/history",         "/times",    "/cell_field_names",
                                       "/condition_names", "/velocity", "/faces/face"};
  const bool may_be_longer =
      name == "/history" || name == "/surface/points" || name == "/voxels/labels" || name.ends_with("/children");
  lies.add_values(name, "empty", !alone.contains(name) || name == "/faces/face", [](Values& v) { v.resize_rows(0); });
  lies.add_values(name, "a row short", !alone.contains(name) || name == "/velocity",
                  [](Values& v) { v.resize_rows(std::max<hsize_t>(v.shape[0], 1) - 1); });
  lies.add_values(name, "a row more", !may_be_longer, [](Values& v) { v.resize_rows(v.shape[0] + 1); });
  if (good.shape[0] > 1) {
    lies.add_values(name, "reversed", false, [](Values& v) {
      const std::size_t row = v.row_bytes();
      std::vector<char> out;
      for (std::size_t n = v.shape[0]; n-- > 0;)
        out.insert(out.end(), v.bytes.begin() + static_cast<std::ptrdiff_t>(n * row),
                   v.bytes.begin() + static_cast<std::ptrdiff_t>((n + 1) * row));
      v.bytes = out;
    });
    lies.add_values(name, "with its first row twice", false, [](Values& v) {
      if (v.shape[0] > 1)
        std::copy_n(v.bytes.begin(), v.row_bytes(), v.bytes.begin() + static_cast<std::ptrdiff_t>(v.row_bytes()));
    });
    lies.add_values(name, "with two rows swapped", false, [](Values& v) {
      if (v.shape[0] < 2) return;
      std::swap_ranges(v.bytes.begin(), v.bytes.begin() + static_cast<std::ptrdiff_t>(v.row_bytes()),
                       v.bytes.end() - static_cast<std::ptrdiff_t>(v.row_bytes()));
    });
  }
  lies.add_values(name, "a hundred thousand rows more", !may_be_longer, [](Values& v) {
    const std::size_t rows = std::min<std::size_t>(100000, 20000000 / std::max<std::size_t>(v.row_bytes(), 1));
    v.resize_rows(v.shape[0] + rows);
  });
}

void add_numbers(LieMaker& lies, const std::string& name, const Values& good) {
  const hid_t other = good.is_float() ? H5T_STD_I32LE : H5T_IEEE_F64LE;
  lies.add_values(name, "of another type", true, [=](Values& v) { v = converted(v, other); });
  lies.add_values(name, "of another size", true,
                  [](Values& v) { v = converted(v, v.is_float() ? H5T_IEEE_F32LE : H5T_STD_I64LE); });
  lies.add_values(name, "as text", true, [](Values& v) {
    const Shape shape = v.shape;
    v = texts(std::vector<std::string>(std::max<std::size_t>(v.count(), 1), "1"));
    v.shape = shape;
  });
  if (good.bytes.empty()) return;
  const std::size_t last = good.count() - 1;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const std::size_t at : std::set<std::size_t>{0, last / 2, last}) {
    const std::string where = at == 0 ? "first" : at == last ? "last" : "middle";
    const auto set = [&](const std::string& what, bool refused, double value) {
      lies.add_values(name, "with " + what + " " + where, refused, [=](Values& v) { v.set(at, value); });
    };
    if (good.is_float()) {
      set("NaN", true, std::nan(""));
      set("infinity", true, infinity);
      set("1e300", true, 1e300);
      set("-1e300", true, -1e300);
      set("1e20", false, 1e20);
      set("-1", false, -1);
      set("0", false, 0);
    } else {
      set("its largest number", false, 1e19);
      set("its least number", false, -1e19);
      set("1000", false, 1000);
    }
    lies.add_values(name, "with one more at the " + where, false, [=](Values& v) { v.set(at, v.get(at) + 1); });
  }
  lies.add_values(name, "all as the first", false, [](Values& v) {
    for (std::size_t n = 1; n < v.count(); ++n) v.set(n, v.get(0));
  });
  lies.add_values(name, "all 0", false, [](Values& v) { std::fill(v.bytes.begin(), v.bytes.end(), 0); });
  lies.add_values(name, "all 1", false, [](Values& v) {
    for (std::size_t n = 0; n < v.count(); ++n) v.set(n, 1);
  });
  if (good.is_float())
    lies.add_values(name, "all NaN", name != "/segments/material", [](Values& v) {
      for (std::size_t n = 0; n < v.count(); ++n) v.set(n, std::nan(""));
    });
}

void add_texts(LieMaker& lies, const std::string& name) {
  lies.add_values(name, "as numbers", true, [](Values& v) {
    v.type = H5T_STD_U8LE;
    v.bytes.resize(v.shape[0]);
  });
  lies.add(name + " of variable length", name != "/costs", [=](hid_t file) {
    Values v = read(file, name);
    if (v.type < 0) return;
    v.type = H5Tcopy(H5T_C_S1);
    H5Tset_size(v.type, H5T_VARIABLE);
    v.bytes.clear();
    put(file, name, v);
  });
  lies.add_values(name, "that is not UTF-8", true,
                  [](Values& v) { std::fill_n(v.bytes.begin(), std::min<std::size_t>(1, v.bytes.size()), '\xff'); });
  lies.add_values(name, "of signs that control", false,
                  [](Values& v) { std::fill_n(v.bytes.begin(), std::min<std::size_t>(1, v.bytes.size()), '\x1b'); });
  lies.add_values(name, "that is a path", false, [](Values& v) {
    const std::string path = "../../x";
    v = texts(std::vector<std::string>(v.shape[0], path));
  });
  lies.add_values(name, "of a million bytes", false,
                  [](Values& v) { v = texts(std::vector<std::string>(v.shape[0], std::string(1000000, 'x'))); });
}

void add_attribute(LieMaker& lies, const Attribute& a) {
  const std::string what = a.object + " attribute " + a.name;
  lies.add(what + " missing", a.name != "tool_version" && a.name != "sha256",
           [=](hid_t file) { H5Adelete_by_name(file, a.object.c_str(), a.name.c_str(), H5P_DEFAULT); });
  using Change = std::function<void(std::vector<double>&)>;
  const auto change = [&](const std::string& how, bool refused, hid_t type, const Change& make) {
    lies.add(what + " " + how, refused, [=](hid_t file) {
      const hid_t old = H5Aopen_by_name(file, a.object.c_str(), a.name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
      if (old < 0) return;
      const hid_t kind = H5Aget_type(old), space = H5Aget_space(old);
      std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
      if (H5Tget_class(kind) != H5T_STRING) H5Aread(old, H5T_NATIVE_DOUBLE, values.data());
      H5Aclose(old);
      make(values);
      H5Adelete_by_name(file, a.object.c_str(), a.name.c_str(), H5P_DEFAULT);
      const hsize_t count = values.size();
      const hid_t line = H5Screate_simple(1, &count, nullptr);
      const hid_t made = H5Acreate_by_name(file, a.object.c_str(), a.name.c_str(), type >= 0 ? type : kind, line,
                                           H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      if (H5Tget_class(type >= 0 ? type : kind) != H5T_STRING) H5Awrite(made, H5T_NATIVE_DOUBLE, values.data());
      H5Aclose(made);
      H5Sclose(line);
      H5Sclose(space);
    });
  };
  const bool is_read = a.name != "tool_version" && a.name != "sha256";
  const auto same = [](std::vector<double>&) {};
  change("of another type", is_read, H5T_STD_I8LE, same);
  change("with one more value", is_read, -1, [](std::vector<double>& v) { v.push_back(1); });
  change("empty", is_read, -1, [](std::vector<double>& v) { v.clear(); });
  if (!is_read || a.name == "format") return;
  const bool is_float = a.name == "spacing" || a.name == "origin" || a.name == "direction";
  for (const double value : {0.0, -1.0, 3.0, 1e20})
    change("with " + std::to_string(static_cast<int>(std::log10(std::max(value, 0.0) + 1))) +
               (value < 0 ? " below" : "") + " digits",
           value == 1e20 && a.name != "format", -1, [=](std::vector<double>& v) { v[0] = value; });
  if (!is_float) return;
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300, -1e300})
    change("with " + std::to_string(value).substr(0, 6), true, -1, [=](std::vector<double>& v) { v[0] = value; });
}

}  // namespace

std::vector<std::string> numbers_in(const fs::path& path) {
  std::vector<std::string> out;
  for (const std::string& name : content_of(path).datasets) {
    const File file(path);
    if (!read(file.id, name).is_text()) out.push_back(name);
  }
  return out;
}

void set_number(const fs::path& path, const std::string& name, std::size_t at, double value) {
  const File file(path);
  Values v = read(file.id, name);
  if (v.type < 0 || v.is_text() || v.count() == 0) return;
  v.set(at % v.count(), value);
  put(file.id, name, v);
}

std::vector<Lie> lies_about(const fs::path& good) {
  LieMaker lies;
  const Content content = content_of(good);
  for (const std::string& name : content.datasets) {
    Values values;
    {
      const File file(good);
      values = read(file.id, name);
    }
    add_storage(lies, name, values.bytes.empty());
    add_shapes(lies, name, values);
    if (values.is_text())
      add_texts(lies, name);
    else
      add_numbers(lies, name, values);
  }
  for (const Attribute& a : content.attributes) add_attribute(lies, a);
  return lies.take();
}

std::vector<Lie> lies_in_reports() {
  LieMaker lies;
  const auto add = [&](const std::string& dataset, const std::string& what, bool refused, const std::string& text) {
    lies.add(dataset + " " + what, refused, [=](hid_t file) { put(file, dataset, texts({text})); });
  };
  for (const std::string dataset : {"/report", "/costs"}) {
    add(dataset, "that is no JSON", true, "not JSON {");
    add(dataset, "that is a list", true, "[1, 2, 3]");
    add(dataset, "that is null", true, "null");
    add(dataset, "of many brackets", true, std::string(300000, '['));
    add(dataset, "of closed brackets", true, std::string(300000, '[') + std::string(300000, ']'));
    std::string many = "{\"a\": [";
    for (int n = 0; n < 3000000; ++n) many += "[],";
    add(dataset, "of millions of lists", true, many + "[]]}");
    add(dataset, "of a number that is none", true, "{\"a\": 1e999}");
  }
  // Of these the library takes all that are objects, and tools refuse what they look at.
  for (const char* text : {R"({"converged": "yes"})",
                           R"({"converged": false, "load_fraction": "half"})",
                           R"({"converged": false, "reason": 5})",
                           R"({"converged": false, "load_fraction": null})",
                           R"({"dropped_cells": -1})",
                           R"({"dropped_cells": 1e300})",
                           R"({"dropped_cells": "all"})",
                           R"({"conditions": 5})",
                           R"({"conditions": [5]})",
                           R"({"conditions": [{"name": 5}]})",
                           R"({"conditions": [{"name": "a", "reaction_n": [1, 2]}]})",
                           R"({"conditions": [{"name": "a"}, {"name": "b"}]})",
                           R"({"levels": {"a": 1}})",
                           R"({"levels": [{"level": "a"}]})",
                           R"({"levels": [{"level": 1e300}]})",
                           R"({"levels": [{"level": 1, "error_mm": [1]}]})",
                           R"({"effects": [[[]]]})",
                           R"({"warnings": [{}]})",
                           R"({"motion": 5})",
                           R"({"motion": {"rows": 5}})",
                           R"({"motion": {"rows": [5]}})",
                           R"({"motion": {"rows": [{"time_s": "a"}]}})",
                           R"({"motion": {"rows": [{"time_s": 1e17, "kinetic_n_mm": 1e17}]}})",
                           R"({"kind": ["a"]})",
                           R"({"lattice": 5})",
                           R"({"error_estimate_mm": 5})"})
    add("/report", text, false, text);
  for (const char* text :
       {R"({"levels": 5})", R"({"levels": ["a"]})", R"({"levels": [[1]]})", R"({"effects": {"a": 1}})",
        R"({"seconds": 5})", R"({"seconds": {"read": {}}})", R"({"peak_memory_mb": "a"})"})
    add("/costs", text, false, text);
  return lies.take();
}

std::vector<Lie> larger_lies(const fs::path& good) {
  LieMaker lies;
  const Content content = content_of(good);
  const auto has = [&](const std::string& name) {
    return std::find(content.datasets.begin(), content.datasets.end(), name) != content.datasets.end();
  };
  const std::string labels = "/voxels/labels";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lies.add_values(labels, "a layer short along axis " + std::to_string(axis), true, [=](Values& v) {
      // The first values of a smaller box, which is what a truncated axis would look like.
      if (v.shape.size() != 3) return;
      v.shape[axis] -= 1;
      v.bytes.resize(v.shape[0] * v.shape[1] * v.shape[2] * v.size_of_value());
    });
    lies.add_values(labels, "of a box of 500 voxels along axis " + std::to_string(axis), true, [=](Values& v) {
      if (v.shape.size() != 3) return;
      v.shape[axis] = 500;
      v.bytes.resize(v.shape[0] * v.shape[1] * v.shape[2] * v.size_of_value());
    });
  }
  for (const std::string& name : content.datasets) {
    if (!name.ends_with("/cells")) continue;
    const std::string group = name.substr(0, name.rfind('/'));
    // A cell less, with all that belongs to cells.
    for (const bool first : {true, false})
      lies.add(name + (first ? " without the first" : " without half of them"), true, [=](hid_t file) {
        for (const std::string of : {"/cells", "/element", "/segment", "/parts", "/cell_nodes"}) {
          if (H5Lexists(file, (group + of).c_str(), H5P_DEFAULT) <= 0) continue;
          Values v = read(file, group + of);
          if (v.type < 0 || v.shape[0] == 0) continue;
          const std::size_t gone = first ? 1 : v.shape[0] / 2;
          v.bytes.erase(v.bytes.begin(), v.bytes.begin() + static_cast<std::ptrdiff_t>(gone * v.row_bytes()));
          v.shape[0] -= gone;
          put(file, group + of, v);
        }
      });
    if (has("/displacement")) continue;
    // Without the last one it is a lattice of fewer levels.
    lies.add(group + " deleted", false, [=](hid_t file) { H5Ldelete(file, group.c_str(), H5P_DEFAULT); });
    lies.add(group + " is the group of all levels", true, [=](hid_t file) {
      H5Ldelete(file, group.c_str(), H5P_DEFAULT);
      H5Lcreate_hard(file, "/levels", file, group.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    });
  }
  if (!has("/displacement"))
    lies.add("a thousand levels that are one", true, [=](hid_t file) {
      for (int n = 3; n < 1000; ++n)
        H5Lcreate_hard(file, "/levels/1", file, ("/levels/" + std::to_string(n)).c_str(), H5P_DEFAULT, H5P_DEFAULT);
    });
  for (const std::string group : {"/voxels", "/segments", "/surface"})
    lies.add(group + " in a linked file", true, [=](hid_t file) {
      H5Lmove(file, group.c_str(), file, "/elsewhere", H5P_DEFAULT, H5P_DEFAULT);
      H5Lcreate_external("good", group.c_str(), file, group.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    });
  return lies.take();
}

}  // namespace testing_support
