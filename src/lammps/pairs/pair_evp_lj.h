// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law/coefficients.h"
#include "lammps/pairs/pair_data.h"
#include "lammps/timestep/stable_timesteps.h"
#include "pair.h"

namespace LAMMPS_NS {

/// Two-regime Lennard-Jones forces with an equilibrium distance per recorded pair (paper eqs. 1-8).
class PairEVPLJ : public Pair, public EVP::HasPairData {
 public:
  PairEVPLJ(class LAMMPS *);
  ~PairEVPLJ() override;

  void compute(int, int) override;
  double single(int, int, int, int, double, double, double, double &) override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  double init_one(int, int) override;

  void write_restart(FILE *) override;
  void read_restart(FILE *) override;
  void write_restart_settings(FILE *) override;
  void read_restart_settings(FILE *) override;

  EVP::PairData *get_pair_data() override { return &pair_data; }

  /// The coefficients but alpha by their names in the table, for fix adapt.
  void *extract(const char *, int &) override;
  int pack_forward_comm(int n, int *indices, double *buf, int pbc_flag, int *pbc) override;
  void unpack_forward_comm(int n, int first, double *buf) override;
  double memory_usage() override
  {
    return Pair::memory_usage() + pair_data.memory_usage() + coefficients.memory_usage();
  }

 private:
  static constexpr int NVALUES = 3;    // p1 ... p3 of compute pair/local

  EVP::Coefficients coefficients;
  EVP::PairData pair_data;
  bool velocities_sent = false;                  // to ghosts, for the last forces
  std::vector<EVP::PairConsumer *> consumers;    // of a list: a step allocates nothing

  void allocate();
  // p1 ... p3 of compute pair/local. Before 2026 LAMMPS copies those of a sub-style of
  // pair_style hybrid without end, and crashes; there, asking for them is an error instead
  void offer_pair_values()
  {
    single_extra = NVALUES;
    for (const char *name : {"hybrid", "hybrid/omp", "hybrid/kk"})    // one class, or its heir
      if (strcmp(force->pair_style, name) == 0) single_extra = 0;
  }
  void take_joining_criterion(std::vector<char *> &words, int k, EVP::JoinRule &) const;
  void sum_forces(bool damps);
  void stop_at_blow_up() const;
  void read_together(FILE *, std::vector<double> &words, size_t n) const;
  void stop_at_damage(const std::string &where) const;
};

}    // namespace LAMMPS_NS
