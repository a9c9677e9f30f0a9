// SPDX-License-Identifier: Apache-2.0
#include "cli/result_report.h"

#include <fmt/format.h>

#include <array>
#include <stdexcept>

#include "hexmesh/core/error.h"
#include "hexmesh/file/json_limits.h"

namespace hextools {
namespace {

using nlohmann::json;

enum class KeyKind { flag, number, count, text, vector, list_of_numbers, list_of_texts, table, rows };

/// A key of an object. Numbers may be null, which is what JSON has for those that are not finite.
struct Key {
  const char* name;
  KeyKind kind;
};

constexpr std::array report_keys = {Key{"kind", KeyKind::text},
                                    Key{"converged", KeyKind::flag},
                                    Key{"is_preview", KeyKind::flag},
                                    Key{"reason", KeyKind::text},
                                    Key{"load_fraction", KeyKind::number},
                                    Key{"accuracy_missed", KeyKind::flag},
                                    Key{"dropped_cells", KeyKind::count},
                                    Key{"held_cells", KeyKind::count},
                                    Key{"strain", KeyKind::text},
                                    Key{"law", KeyKind::text},
                                    Key{"volumetric", KeyKind::text},
                                    Key{"stiffness", KeyKind::text},
                                    Key{"lattice", KeyKind::table},
                                    Key{"balance", KeyKind::table},
                                    Key{"error_estimate_mm", KeyKind::table},
                                    Key{"motion", KeyKind::table},
                                    Key{"conditions", KeyKind::rows},
                                    Key{"forces", KeyKind::rows},
                                    Key{"contacts", KeyKind::rows},
                                    Key{"levels", KeyKind::rows},
                                    Key{"effects", KeyKind::rows},
                                    Key{"warnings", KeyKind::list_of_texts}};
constexpr std::array costs_keys = {Key{"levels", KeyKind::list_of_numbers}, Key{"effects", KeyKind::list_of_numbers},
                                   Key{"seconds", KeyKind::table}, Key{"peak_memory_mb", KeyKind::number}};
constexpr std::array condition_keys = {Key{"name", KeyKind::text}, Key{"moves", KeyKind::flag},
                                       Key{"reaction_n", KeyKind::vector}};
constexpr std::array contact_keys = {Key{"name", KeyKind::text},      Key{"plane", KeyKind::table},
                                     Key{"sphere", KeyKind::table},   Key{"capsule", KeyKind::table},
                                     Key{"cylinder", KeyKind::table}, Key{"box", KeyKind::table}};
constexpr std::array obstacle_keys = {Key{"point_mm", KeyKind::vector},  Key{"normal", KeyKind::vector},
                                      Key{"center_mm", KeyKind::vector}, Key{"radius_mm", KeyKind::number},
                                      Key{"from_mm", KeyKind::vector},   Key{"to_mm", KeyKind::vector},
                                      Key{"size_mm", KeyKind::vector},   Key{"axis_x", KeyKind::vector},
                                      Key{"axis_y", KeyKind::vector},    Key{"axis_z", KeyKind::vector}};
constexpr std::array level_keys = {Key{"level", KeyKind::count}, Key{"seconds", KeyKind::number},
                                   Key{"error_mm", KeyKind::table}};
constexpr std::array balance_keys = {Key{"about_mm", KeyKind::vector}, Key{"acting", KeyKind::rows},
                                     Key{"sum", KeyKind::table}};
constexpr std::array acting_keys = {Key{"name", KeyKind::text}, Key{"force_n", KeyKind::vector},
                                    Key{"moment_n_mm", KeyKind::vector}};
constexpr std::array motion_keys = {Key{"rows", KeyKind::rows}};
constexpr std::array row_keys = {Key{"time_s", KeyKind::number}, Key{"kinetic_n_mm", KeyKind::number},
                                 Key{"strain_n_mm", KeyKind::number}, Key{"contact_n_mm", KeyKind::number}};

bool is_number(const json& v) { return v.is_number() || v.is_null(); }

template <class Is>
bool all_are(const json& list, Is is) {
  if (!list.is_array()) return false;
  for (const json& v : list)
    if (!is(v)) return false;
  return true;
}

bool is_of(const json& v, KeyKind kind) {
  constexpr double most_count = 0x1p52;
  switch (kind) {
    case KeyKind::flag:
      return v.is_boolean();
    case KeyKind::number:
      return is_number(v);
    case KeyKind::count:
      return v.is_number_unsigned() && v.get<double>() <= most_count;
    case KeyKind::text:
      return v.is_string();
    case KeyKind::vector:
      return v.is_array() && v.size() == 3 && all_are(v, is_number);
    case KeyKind::list_of_numbers:
      return all_are(v, is_number);
    case KeyKind::list_of_texts:
      return all_are(v, [](const json& t) { return t.is_string(); });
    case KeyKind::table:
      return v.is_object();
    case KeyKind::rows:
      return all_are(v, [](const json& row) { return row.is_object(); });
  }
  return false;
}

const char* name_of(KeyKind kind) {
  constexpr std::array names = {"true or false",   "a number",      "a whole number >= 0",
                                "a text",          "three numbers", "a list of numbers",
                                "a list of texts", "an object",     "a list of objects"};
  return names[static_cast<std::size_t>(kind)];
}

[[noreturn]] void refuse(const std::string& what) {
  throw hexmesh::Error(hexmesh::ErrorKind::input, "the result's " + what);
}

template <std::size_t N>
void check(const json& object, const std::array<Key, N>& keys, const std::string& path) {
  for (const Key& key : keys) {
    const auto found = object.find(key.name);
    if (found == object.end() || is_of(*found, key.kind)) continue;
    std::string value = found->dump(-1, ' ', false, json::error_handler_t::replace);
    constexpr std::size_t most_shown = 60;
    if (value.size() > most_shown) value = value.substr(0, most_shown) + "...";
    refuse(fmt::format("'{}/{}' is {}, expected {}", path, key.name, value, name_of(key.kind)));
  }
}

/// Rows of a list in an object, and an empty list where there is none.
template <std::size_t N>
void check_rows(json& object, const char* name, const std::array<Key, N>& keys, const std::string& path) {
  json& rows = object[name];
  if (rows.is_null()) rows = json::array();
  for (std::size_t n = 0; n < rows.size(); ++n) check(rows[n], keys, fmt::format("{}/{}/{}", path, name, n));
}

json parse(const std::string& text, const char* dataset) {
  if (text.empty()) return json::object();
  try {
    json out = hexmesh::parse_json(text);
    if (out.is_object()) return out;
  } catch (const std::runtime_error& e) {
    refuse(fmt::format("'{}' is {}", dataset, e.what()));
  }
  refuse(fmt::format("'{}' is no object", dataset));
}

}  // namespace

ResultReport report_of(const hexmesh::Result& result) {
  ResultReport out{parse(result.report, "/report"), parse(result.costs, "/costs")};
  json& report = out.report;
  check(report, report_keys, "/report");
  check(out.costs, costs_keys, "/costs");
  check_rows(report, "conditions", condition_keys, "/report");
  check_rows(report, "levels", level_keys, "/report");
  check_rows(report, "contacts", contact_keys, "/report");
  for (const json& contact : report["contacts"])
    for (const char* shape : {"plane", "sphere", "capsule", "cylinder", "box"})
      if (contact.contains(shape)) check(contact[shape], obstacle_keys, fmt::format("/report/contacts/{}", shape));
  for (const char* list : {"forces", "effects", "warnings"})
    if (!report.contains(list)) report[list] = json::array();
  if (report.contains("balance")) {
    json& balance = report["balance"];
    check(balance, balance_keys, "/report/balance");
    check_rows(balance, "acting", acting_keys, "/report/balance");
    if (!balance.contains("sum")) balance["sum"] = json::object();
    if (!balance.contains("about_mm")) balance["about_mm"] = nullptr;
    check(balance["sum"], acting_keys, "/report/balance/sum");
  }
  if (report.contains("motion")) {
    check(report["motion"], motion_keys, "/report/motion");
    check_rows(report["motion"], "rows", row_keys, "/report/motion");
  }
  return out;
}

}  // namespace hextools
