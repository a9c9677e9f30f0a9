// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/element_tree.h"

#include <stdexcept>

namespace hexmesh {
namespace {

/// Levels with no more elements than this keep them in any case (14 MB).
constexpr std::size_t few_elements = 1 << 14;

}  // namespace

ElementTree::ElementTree(const Lattice& lattice) : lattice_(lattice), kept_(lattice.levels.size()), voxel_fill_{} {
  for (std::size_t l = 1; l < kept_.size(); ++l) {
    const Level& level = lattice.levels[l];
    const std::size_t count = level.children.size();
    kept_[l].keeps = count <= few_elements || 2 * count < level.element.size();
    if (!kept_[l].keeps) continue;
    kept_[l].elements.resize(count);
    kept_[l].known.resize(count);
  }
  if (lattice.levels.size() < 2) return;
  const Element voxel = full_voxel(Material{}, lattice.voxels.voxel_volume());
  for (int slot = 0; slot < 8; ++slot) {
    Element parent;
    add_child(parent, voxel, slot, lattice.levels[1].merge);
    voxel_fill_[slot] = parent.fill;
  }
}

void ElementTree::add_voxel(Element& parent, std::int32_t material, int slot) const {
  const Material& m = lattice_.materials[material].material;
  const double shear = m.shear_modulus(), bulk = m.bulk_modulus();
  const Element::Weights& fill = voxel_fill_[slot];
  for (std::size_t q = 0; q < num_rule_points; ++q) {
    parent.shear[q] += shear * fill[q];
    parent.bulk[q] += bulk * fill[q];
    parent.density[q] += m.density * fill[q];
    parent.fill[q] += fill[q];
  }
}

Element ElementTree::form(int level, std::int32_t element) {
  if (level == 0) return full_voxel(lattice_.materials[element].material, lattice_.voxels.voxel_volume());
  Kept& kept = kept_[level];
  if (kept.keeps && kept.known[element]) return kept.elements[element];
  const Level& of = lattice_.level(level);
  const Children& children = of.children[element];
  Element parent;
  for (int slot = 0; slot < 8; ++slot) {
    const std::int32_t child = children[slot];
    if (child < 0) continue;
    if (level == 1)
      add_voxel(parent, child, slot);
    else
      add_child(parent, form(level - 1, child), slot, of.merge);
  }
  if (kept.keeps) {
    kept.elements[element] = parent;
    kept.known[element] = true;
  }
  return parent;
}

std::vector<Element> ElementTree::form_all(int level) {
  const Level& of = lattice_.level(level);
  if (level > 0 && of.children.empty() && !of.cells.empty())
    throw std::logic_error("elements of a level that was read without children");
  std::vector<Element> elements(of.filled.size());
  for (std::size_t e = 0; e < elements.size(); ++e) elements[e] = form(level, static_cast<std::int32_t>(e));
  return elements;
}

std::vector<Element> form_elements(const Lattice& lattice, int level) { return ElementTree(lattice).form_all(level); }

}  // namespace hexmesh
