// SPDX-License-Identifier: GPL-2.0-only

#include "zone_bonds.h"

#include "atom_bodies.h"
#include "collective.h"
#include "core/pair_list.h"
#include "pair_network.h"

#include "atom.h"
#include "domain.h"
#include "neigh_list.h"

#include <cmath>

using namespace LAMMPS_NS;

// Square of the distance of a neighbor, from either side the same to the last bit, so that both atoms
// of a pair decide alike. The position of a ghost is that of its owner and whole periodic vectors, but
// for round-off, which differs between the images of i and of j.
static double symmetric_dsq(const Atom *atom, const Domain *domain,
                            const std::vector<double> &owner_x, int i, int j)
{
  const double *const at = &owner_x[(size_t) 3 * i], *const other = &owner_x[(size_t) 3 * j];
  double shift[3] = {0.0, 0.0, 0.0};
  if (j >= atom->nlocal) {
    for (int c = 0; c < 3; c++) shift[c] = atom->x[j][c] - other[c];
    const double nz = std::round(shift[2] / domain->zprd);
    const double ny = std::round((shift[1] - nz * domain->yz) / domain->yprd);
    const double nx = std::round((shift[0] - ny * domain->xy - nz * domain->xz) / domain->xprd);
    shift[0] = nx * domain->xprd + ny * domain->xy + nz * domain->xz;
    shift[1] = ny * domain->yprd + nz * domain->yz;
    shift[2] = nz * domain->zprd;
  }
  // the difference of the owners' positions is the same number, but for its sign
  double dsq = 0.0;
  for (int c = 0; c < 3; c++) {
    const double d = (other[c] - at[c]) + shift[c];
    dsq += d * d;
  }
  return dsq;
}

std::vector<EVP::BondStore::Bonds>
LAMMPS_NS::find_zone_bonds(const LAMMPS *lmp, const NeighList *list,
                           const std::vector<double> &owner_x, double zone, int groupbit,
                           const AtomBodies &bodies, const PairNetwork *network, bigint &overlaps)
{
  bigint overlap_sides = 0;    // both atoms see a pair
  std::vector<EVP::BondStore::Bonds> made(lmp->atom->nlocal);
  std::string complaint;
  const Atom *atom = lmp->atom;
  const int *mask = atom->mask;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (!(mask[i] & groupbit)) continue;
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int j = list->firstneigh[i][jj] & NEIGHMASK;
      const double alpha = network->alpha_of(atom->type[i], atom->type[j]);
      if (!(mask[j] & groupbit) || alpha == 0.0) continue;

      const double dsq = symmetric_dsq(atom, lmp->domain, owner_x, i, j);
      const double sum_radii = atom->radius[i] + atom->radius[j];
      const double reach = (zone > 0.0 ? zone : alpha) * sum_radii;
      if (dsq > EVP::reach_squared(reach, EVP::RECORD_MARGIN)) continue;
      if (bodies.apart(i, j)) {
        if (dsq < EVP::reach_squared(sum_radii, -EVP::RECORD_MARGIN)) overlap_sides++;
        continue;
      }
      const double coincident = EVP::COINCIDENT * sum_radii;
      if (!(dsq > coincident * coincident) && complaint.empty())
        complaint = fmt::format("atoms {} and {} coincide: move one or delete it (delete_atoms "
                                "overlap)",
                                atom->tag[i], atom->tag[j]);
      made[i].push_back({atom->tag[j], std::sqrt(dsq)});
    }
  }
  EVP::throw_together(complaint, lmp->world);
  overlaps = EVP::reduce_all(overlap_sides, MPI_SUM, lmp->world) / 2;
  return made;
}
