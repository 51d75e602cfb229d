// SPDX-License-Identifier: GPL-2.0-only
//
// The loop over pairs in double, mixed and single precision: its times, the errors of its forces, and
// what these do to a ringing body, each as CSV. tools/precision.py makes a page of them.

#include "ringing.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>

using namespace precision;
using EVP::Level;

namespace {

constexpr double STRAINS[] = {1e-5, 1e-4, 1e-3, 1e-2};
constexpr double RINGING_STRAINS[] = {1e-5, 1e-4};
constexpr double TIMED_STRAIN = 1e-3;
constexpr double SAME_LOOP = 1e-13;      // of the largest pair force
constexpr double PAIRS_AT_ONCE = 1e6;    // a few ms: what disturbs is met by few samples, or by all

#if defined(__clang__)
constexpr char COMPILER[] = __VERSION__;
#elif defined(__GNUC__)
constexpr char COMPILER[] = "g++ " __VERSION__;
#else
constexpr char COMPILER[] = "unnamed compiler";
#endif

/// Calls f(name, types) for every variant.
template <class F> void for_each_variant(F &&f)
{
  f("double", Double());
  f("mixed, strain in double", StrainFirst());
  f("mixed", Mixed());
  f("mixed, float positions", FloatPositions());
  f("single", Single());
}

/// One way to the forces of a lattice.
struct Way {
  std::string name;
  std::function<void(Level)> use;
  std::function<void()> clear, sweep;    ///< forces to zero; forces
  std::function<void()>
      copy;    ///< from and to what LAMMPS holds in double, where it is not in use
};

template <class T>
Way way_in(const char *name, const Lattice &lattice, const Vectors &x, Vectors &f)
{
  constexpr bool in = !std::is_same_v<typename T::Position, double>;
  constexpr bool out = !std::is_same_v<typename T::Sum, double>;
  const auto loop = std::make_shared<Loop<T>>(lattice.list, lattice.law, x.size());
  loop->take_positions(x);
  Way way;
  way.name = name;
  way.use = [loop](Level level) {
    loop->use(level);
  };
  way.clear = [loop] {
    loop->clear_forces();
  };
  way.sweep = [loop] {
    loop->accumulate();
  };
  if (in || out)
    way.copy = [loop, &x, &f] {
      if (in) loop->take_positions(x);
      if (out) loop->add_forces_to(f);
    };
  return way;
}

Way own_way(const Lattice &lattice, const Vectors &x, Vectors &f)
{
  const auto law = std::make_shared<EVP::BlockLaw>();
  Way way;
  way.name = "force_loop.h";
  way.use = [law, &lattice](Level level) {
    law->assign({lattice.law}, {0}, level);
  };
  way.clear = [&f] {
    std::fill(f.begin(), f.end(), std::array<double, 3>{});
  };
  way.sweep = [law, &lattice, &x, &f] {
    accumulate_own(lattice, *law, x, f);
  };
  return way;
}

double nanoseconds_of(const std::function<void()> &work, int times)
{
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  for (int k = 0; k < times; k++) work();
  return std::chrono::duration<double, std::nano>(Clock::now() - begin).count() / times;
}

const char *name_of(Level level)
{
  return level == Level::AVX512 ? "AVX-512" : level == Level::AVX2 ? "AVX2" : "base";
}

/// Every way on every instruction set in every round, in an order of its own: what the way before
/// left in the caches is not always the same.
void print_times(const Lattice &lattice, int rounds)
{
  const Vectors x = lattice.stretched(TIMED_STRAIN);
  Vectors f(x.size(), {0, 0, 0});
  std::vector<Way> ways = {own_way(lattice, x, f)};
  for_each_variant([&](const char *name, auto types) {
    ways.push_back(way_in<decltype(types)>(name, lattice, x, f));
  });
  std::vector<std::pair<Level, const Way *>> runs;
  for (const Level level : {Level::AVX512, Level::AVX2, Level::BASE})
    for (const Way &way : ways)
      if (level <= EVP::best_level()) runs.push_back({level, &way});

  const double pairs = (double) lattice.list.pairs.size();
  const int sweeps = std::max(1, (int) (PAIRS_AT_ONCE / pairs));
  std::mt19937 random(1);
  std::printf("round,spheres,pairs,compiler,level,variant,ns,copies_ns\n");
  for (int round = 0; round < rounds; round++) {
    std::shuffle(runs.begin(), runs.end(), random);
    for (const auto &[level, way] : runs) {
      way->use(level);
      way->clear();
      way->sweep();
      const double ns = nanoseconds_of(way->sweep, sweeps) / pairs;
      const double copies = way->copy ? nanoseconds_of(way->copy, sweeps) / pairs : 0.0;
      std::printf("%d,%zu,%.0f,\"%s\",%s,\"%s\",%.4g,%.4g\n", round, x.size(), pairs, COMPILER,
                  name_of(level), way->name.c_str(), ns, copies);
    }
  }
}

/// False if the double copy of the loop is not the project's own.
bool print_errors(const Lattice &lattice)
{
  const Lattice apart = pairs_apart(lattice);
  double off = 0.0;
  std::printf("reach,xi_s,strain,variant,pair_max,pair_rms,sphere_max,sphere_rms,off_kernel\n");
  for (const double xi : STRAINS) {
    const Vectors x = lattice.stretched(xi), x_apart = apart.stretched(xi);
    const Truth truth = plain_sum(lattice, x), of_pairs = plain_sum(apart, x_apart);
    const Truth own = {forces_of_kernel(lattice, x), truth.largest};
    for_each_variant([&](const char *name, auto types) {
      using T = decltype(types);
      const Vectors f = forces_in<T>(lattice, x);
      const Error pair = error_of(forces_in<T>(apart, x_apart), of_pairs);
      const Error sphere = error_of(f, truth);
      const double off_kernel = error_of(f, own).largest;
      if (std::is_same_v<T, Double>) off = std::max(off, off_kernel);
      std::printf("%.3g,%g,%.0e,\"%s\",%.3e,%.3e,%.3e,%.3e,%.3e\n", lattice.reach(), table1().xi_s,
                  xi, name, pair.largest, pair.rms, sphere.largest, sphere.rms, off_kernel);
    });
  }
  if (off > SAME_LOOP)
    std::fprintf(stderr, "precision: error: the double copy is %.2g off force_loop.h\n", off);
  return off <= SAME_LOOP;
}

void print_ringing(const Lattice &lattice, int steps)
{
  std::printf("spheres,reach,step,steps,strain,variant,energy,momentum\n");
  for (const double xi : RINGING_STRAINS)
    for_each_variant([&](const char *name, auto types) {
      const Ringing found = ring<decltype(types)>(lattice, xi, steps);
      std::printf("%zu,%.3g,%g,%d,%.0e,\"%s\",%.3e,%.3e\n", lattice.rest.size(), lattice.reach(),
                  RINGING_STEP, steps, xi, name, found.energy, found.momentum);
    });
}

/// 0 where the word is no whole number of 1 to largest.
int whole_number(const char *word, int largest)
{
  char *end;
  const long value = std::strtol(word, &end, 10);
  return *end == '\0' && value >= 1 && value <= largest ? (int) value : 0;
}

}    // namespace

int main(int argc, char **argv)
{
  const bool times = argc == 4 && !std::strcmp(argv[1], "times");
  const bool errors = argc == 3 && !std::strcmp(argv[1], "errors");
  const bool ringing = argc == 4 && !std::strcmp(argv[1], "ringing");
  const int cells = times || errors || ringing ? whole_number(argv[2], 100) : 0;
  const int count = times || ringing ? whole_number(argv[3], 10000000) : 1;
  if (!cells || !count) {
    std::fprintf(stderr,
                 "usage: precision times CELLS ROUNDS\n"
                 "       precision errors CELLS\n"
                 "       precision ringing CELLS STEPS\n"
                 "  CELLS  of the FCC lattice along an edge, 4 spheres each: 1 to 100\n");
    return 2;
  }
  const double far =
      20.0;    // as far from the origin as the large lattice, whose corner lies there
  const Lattice lattice = make_lattice(cells, ringing ? far : 0.0);
  if (times) print_times(lattice, count);
  if (ringing) print_ringing(lattice, count);
  return errors && !print_errors(lattice) ? 1 : 0;
}
