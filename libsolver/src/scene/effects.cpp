// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/scene/effects.h"

#include <fmt/format.h>

namespace hexsolver {

const char* name_of(EffectKind kind) {
  switch (kind) {
    case EffectKind::elasticity:
      return "elasticity";
    case EffectKind::rotation:
      return "rotation";
    case EffectKind::large_strain:
      return "large strain";
    case EffectKind::near_incompressibility:
      return "near-incompressibility";
    case EffectKind::force:
      return "force";
    case EffectKind::contact:
      return "contact";
    case EffectKind::match:
      return "match";
    case EffectKind::prestress:
      return "prestress";
    case EffectKind::gravity:
      return "gravity";
    case EffectKind::rest_shape:
      return "shape without load";
    case EffectKind::islands:
      return "islands";
    case EffectKind::inertia:
      return "inertia";
    case EffectKind::damping:
      return "damping";
    case EffectKind::grab:
      return "grabs";
    case EffectKind::error_estimate:
      return "error estimate";
  }
  return "";
}

namespace {

Effect effect(EffectKind kind, bool active, const std::string& why) { return {kind, name_of(kind), active, why}; }

Effect rotation_effect(const Scene& scene) {
  Effect e = effect(EffectKind::rotation, scene.elasticity != Elasticity::cauchy, "");
  if (scene.finds_strain && scene.dynamics)
    e.why = "solve.strain = \"auto\": cells rotate from where one would take 2.5e-4 of its rotation for strain";
  else if (scene.finds_strain)
    e.why = "solve.strain = \"auto\": if rotating cells on a coarse level changes more than the accuracy";
  else if (is_hyperelastic(scene.elasticity))
    e.why = "part of large strain";
  else if (scene.elasticity == Elasticity::cauchy)
    e.why = "solve.strain = \"cauchy\": small strain, no cell rotates";
  else if (scene.rotation == Rotation::polar)
    e.why = "solve.strain = \"corotational\": each cell rotates with its material";
  else
    e.why = "solve.rotation = \"edges\": each cell rotates with its averaged edges";
  return e;
}

Effect large_strain_effect(const Scene& scene) {
  switch (scene.elasticity) {
    case Elasticity::green_lagrange:
      return effect(EffectKind::large_strain, true,
                    "solve.strain = \"green-lagrange\": St. Venant-Kirchhoff at points of the cells");
    case Elasticity::neo_hookean:
      return effect(EffectKind::large_strain, true, "solve.law = \"neo-hookean\" at points of the cells");
    case Elasticity::stable_neo_hookean:
      return effect(EffectKind::large_strain, true, "solve.law = \"stable-neo-hookean\" at points of the cells");
    default:
      return effect(EffectKind::large_strain, false,
                    "solve.law = \"hooke\" with small strain in the frame of each cell");
  }
}

}  // namespace

std::vector<Effect> list_effects(const Scene& scene) {
  std::vector<Effect> effects;
  effects.push_back(effect(EffectKind::elasticity, true, "every scene has it"));
  effects.push_back(rotation_effect(scene));
  effects.push_back(large_strain_effect(scene));
  const bool mean = scene.volumetric == Volumetric::mean;
  effects.push_back(
      effect(EffectKind::near_incompressibility, mean,
             mean ? "solve.volumetric = \"mean\": one dilatation per cell, so that coarse cells do not lock"
                  : "solve.volumetric = \"full\": dilatation varies in a cell"));
  for (const Force& f : scene.forces)
    effects.push_back({EffectKind::force, load_name(f), true, fmt::format("[[force]] at {}", f.where)});
  if (scene.forces.empty()) effects.push_back({EffectKind::force, "forces", false, "the scene has no [[force]]"});
  for (const Contact& c : scene.contacts)
    effects.push_back({EffectKind::contact, contact_name(c), true, fmt::format("[[contact]] at {}", c.where)});
  if (scene.contacts.empty())
    effects.push_back(effect(EffectKind::contact, false, "the scene has no [[contact]]: no distances"));
  for (const Match& m : scene.matches)
    effects.push_back({EffectKind::match, match_name(m), true, fmt::format("[[match]] at {}", m.where)});
  if (scene.matches.empty())
    effects.push_back(effect(EffectKind::match, false, "the scene has no [[match]]: no surface is sought"));
  for (const Prestress& p : scene.prestresses)
    effects.push_back({EffectKind::prestress, prestress_name(p), true, fmt::format("[[prestress]] at {}", p.where)});
  if (scene.prestresses.empty())
    effects.push_back(
        effect(EffectKind::prestress, false, "the scene has no [[prestress]]: no cell is stressed by itself"));
  const bool weighs = scene.gravity != Vec3::Zero();
  effects.push_back(effect(EffectKind::gravity, weighs,
                           fmt::format("the scene has {}[{}gravity]{}", weighs ? "" : "no ",
                                       scene.is_of_lattice ? "loaded." : "", weighs ? "" : ": no masses")));
  effects.push_back(effect(EffectKind::rest_shape, scene.loaded.has_value(),
                           scene.loaded ? "solve.reference = \"loaded\": where the body is at rest is solved for first"
                                        : "solve.reference = \"rest\": the body is at rest as the lattice shows it"));
  const std::string still = scene.dynamics ? "" : "solve.kind = \"equilibrium\": nothing moves";
  effects.push_back(
      effect(EffectKind::inertia, scene.dynamics.has_value(), scene.dynamics ? "solve.kind = \"dynamics\"" : still));
  const bool damps = scene.damping.mass_per_s > 0 || scene.damping.stiffness_s > 0;
  effects.push_back(effect(EffectKind::damping, damps && scene.dynamics,
                           !scene.dynamics ? still
                           : damps         ? "the scene has [damping]"
                                           : "the scene has no [damping]: only the steps damp"));
  if (scene.dynamics) return effects;
  const bool is_off = scene.error_estimation == ErrorEstimation::off && !scene.asks_accuracy();
  effects.push_back(effect(EffectKind::error_estimate, false,
                           is_off ? "solve.error_estimate = \"off\""
                                  : "differences between the levels that a solution passes and the next finer one"));
  return effects;
}

}  // namespace hexsolver
