// SPDX-License-Identifier: GPL-2.0-only
// The effects that rules of the pair style call for, and nothing else.

#include "lammps/failure/failure.h"
#include "lammps/joining/joining.h"
#include "lammps/plasticity/plasticity.h"
#include "lammps/stress/sphere_stresses.h"
#include "lammps/yield/yield_condition.h"

namespace EVP {

std::vector<std::shared_ptr<Effect>> make_effects(LAMMPS *lmp, PairData &pair_data)
{
  std::vector<std::shared_ptr<Effect>> made;
  if (pair_data.rules().plastic) {
    made.push_back(std::make_shared<Plasticity>(lmp, pair_data));
    made.push_back(std::make_shared<YieldCondition>(lmp, pair_data));
    made.push_back(std::make_shared<Failure>(lmp, pair_data));
    made.push_back(std::make_shared<Joining>(lmp, pair_data));
    made.push_back(std::make_shared<SphereStresses>(lmp, pair_data));
  }
  return made;
}

}    // namespace EVP
