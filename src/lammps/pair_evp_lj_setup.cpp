/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: what it finds and checks before a run. */

#include "pair_evp_lj.h"

#include "fix_evp_bonds.h"
#include "scene.h"

#include "atom.h"
#include "atom_vec.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void PairEVPLJ::init_style()
{
  check_host_settings();
  find_max_radii();
  find_bonds();
  find_implicit_group();
  overlap_warned = false;
  radii_vary = !atom->avec->comm_x_only;    // then radii are sent at every step
  packed_call = packed_step = -1;
  reach.assign(max_radius.size() * max_radius.size(), -1.0);
  any_gamma = scene_checked = false;
  neighbor->add_request(this);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::check_host_settings() const
{
  if (!atom->radius_flag)
    error->all(FLERR, "Pair evp/lj needs particles with a radius: use 'atom_style sphere'");
  if (find(force) != this)
    error->all(FLERR,
               "Pair evp/lj can be one sub-style of pair_style hybrid only, as a pair has one deq: "
               "give its types rows of their own instead");
  if (!atom->tag_enable)
    error->all(FLERR, "Pair evp/lj needs atom IDs: remove 'atom_modify id no'");
  if (!compute_flag && update->whichflag != 0)
    error->all(
        FLERR,
        "Pair evp/lj cannot run with 'pair_modify compute no', as fixes and computes read the "
        "pairs that it finds: use 'pair_style none' for a run without forces");
  if (utils::strmatch(force->pair_style, "^hybrid/scaled"))
    error->all(FLERR,
               "Pair evp/lj does not work in pair_style hybrid/scaled, which would scale its "
               "forces but not the steps and energies derived from them: use hybrid/overlay");
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::find_max_radii()
{
  const int ntypes = (int) max_radius.size();
  std::vector<double> largest(ntypes, 0.0), smallest(ntypes, HUGE_VAL);
  for (int i = 0; i < atom->nlocal; i++) {
    const int type = atom->type[i];
    const double radius = atom->radius[i];
    largest[type] = std::max(largest[type], radius);
    smallest[type] = std::min(smallest[type], std::isfinite(radius) ? radius : -HUGE_VAL);
  }
  MPI_Allreduce(largest.data(), max_radius.data(), ntypes, MPI_DOUBLE, MPI_MAX, world);
  min_radius.resize(ntypes);
  MPI_Allreduce(smallest.data(), min_radius.data(), ntypes, MPI_DOUBLE, MPI_MIN, world);

  // particles to come
  for (Fix *fix : modify->get_fix_list())
    if (utils::strmatch(fix->style, "^pour") || utils::strmatch(fix->style, "^deposit"))
      for (int type = 1; type <= atom->ntypes; type++) {
        int itype = type;
        const auto *radius = (const double *) fix->extract("radius", itype);
        if (radius) max_radius[type] = std::max(max_radius[type], *radius);
      }
}

/* ----------------------------------------------------------------------
   the fix that holds deq of the recorded pairs; once there were records,
   going on without them would silently be another material
------------------------------------------------------------------------- */

void PairEVPLJ::find_bonds()
{
  bonds = dynamic_cast<FixEVPBonds *>(EVP::scene::find_fix(modify, "evp/bonds"));
  const bool kept = bonds && bonds->has_recorded();
  if (!bonds_id.empty() && (!kept || bonds_id != bonds->id))
    error->all(FLERR,
               "Pair evp/lj: the bonds were recorded by fix {}, whose records are not here: define "
               "'fix {} all evp/bonds' right after read_restart and before the run, or start anew "
               "with 'pair_style none' and 'pair_style evp/lj'",
               bonds_id, bonds_id);
  if (kept) bonds_id = bonds->id;
}

/* ----------------------------------------------------------------------
   fix nve/evp solves the damping of its atoms; the explicit one leaves them out
------------------------------------------------------------------------- */

void PairEVPLJ::find_implicit_group()
{
  const Fix *implicit = EVP::scene::find_fix(modify, "nve/evp");
  implicit_groupbit = implicit ? implicit->groupbit : 0;
  repack = true;
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::bonds_recorded_by(const std::string &id)
{
  if (id.empty()) {
    if (!bonds_id.empty()) dropped_bonds_id = bonds_id;
    bonds = nullptr;
  }
  bonds_id = id;
  repack = true;
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::init_one(int i, int j)
{
  if (!setflag[i][j])
    error->all(FLERR,
               "Pair evp/lj does not mix unlike types: give 'pair_coeff {} {}' a row of its own", i,
               j);
  const double smallest = std::min(min_radius[i], min_radius[j]);
  if (!(smallest > 0.0))
    error->all(
        FLERR,
        "Pair evp/lj needs particles with a radius above zero, and finite, found {} in types {} "
        "and {}: use 'set ... diameter'",
        smallest, i, j);

  EVP::Row row;
  try {
    row = coefficients.make_law(i, j);
  } catch (const EVP::BadInput &bad) {
    error->all(FLERR, "Pair evp/lj, types {} and {}: {}", i, j, bad.what());
  }
  repack = true;

  if (row.gamma > 0.0) any_gamma = true;    // fix adapt may have switched it on

  // called once at set-up, and again by fix adapt while the neighbor list keeps its reach
  const double cut = row.alpha * (max_radius[i] + max_radius[j]);
  double &longest = reach[coefficients.index(i, j)];
  if (longest < 0.0) longest = cut;
  if (cut > longest * (1.0 + 1.0e-12))
    error->all(
        FLERR,
        "Pair evp/lj, types {} and {}: alpha must not grow during a run, as the neighbor list "
        "keeps its reach: start with the largest, or split the run there",
        i, j);
  return cut * (1.0 + EVP::LIST_MARGIN);
}

/* ----------------------------------------------------------------------
   pair_style hybrid may have given a pair of types with coefficients here to another
   sub-style; init_one() tells
------------------------------------------------------------------------- */

bool PairEVPLJ::serves(int i, int j) const
{
  return allocated && !reach.empty() &&
      reach[coefficients.index(std::min(i, j), std::max(i, j))] >= 0.0;
}

/* ----------------------------------------------------------------------
   once per run, when all pairs of types are known: before the first forces, by all processes
------------------------------------------------------------------------- */

void PairEVPLJ::check_scene()
{
  scene_checked = true;

  report_settings();

  // of types that it does not serve this style asks nothing
  for (int i = 1; i <= atom->ntypes; i++) {
    bool served = false;
    for (int j = 1; j <= atom->ntypes; j++) served = served || serves(i, j);
    if (!served) max_radius[i] = HUGE_VAL;
  }
}

/* ----------------------------------------------------------------------
   one line of what this scene calls for, again only when it changes
------------------------------------------------------------------------- */

void PairEVPLJ::report_settings()
{
  const char *contact[] = {"literal", "repulsive", "none"};
  std::string report = "evp/lj: ";
  if (!any_gamma)
    report += "damping off";
  else
    report += !damping_acts() ? "damping off (minimization)"
        : damps_implicitly()  ? "damping by fix nve/evp"
                              : "damping on";
  report += fmt::format(", new contacts {}", contact[(int) settings_now.contact]);
  if (bonds)
    report += fmt::format(", deq of bonds from fix {}", bonds->id);
  else
    report += ", no fix evp/bonds: every pair has deq = R_i + R_j";
  report += fmt::format(", overlap warned of beyond {} (R_i + R_j)\n", settings_now.overlap);

  if (report == last_report) return;
  last_report = report;
  if (comm->me) return;
  utils::logmesg(lmp, report);
  if (!bonds && settings_now.contact == Contact::NONE)
    error->warning(FLERR,
                   "Pair evp/lj with contact none and without fix evp/bonds: nothing acts at all");
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (serves(i, j) && alpha_of(i, j) < 1.4 && settings_now.contact == Contact::LITERAL)
        error->warning(FLERR,
                       "Pair evp/lj, types {} and {}: alpha = {} is below 1.4, where literal new "
                       "contacts can pull the body together; use contact repulsive or none",
                       i, j, alpha_of(i, j));
}
