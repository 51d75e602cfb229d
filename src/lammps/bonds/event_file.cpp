// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/bonds/event_file.h"

#include "lammps/base/collective.h"

#include "comm.h"
#include "error.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <tuple>
#include <utility>

namespace EVP {

EventFile::EventFile(LAMMPS *lmp, const std::string &who_in, const std::string &name_in) :
    Pointers(lmp), who(who_in), name(name_in)
{
  if (comm->me == 0) file = fopen(name.c_str(), "a");
  if (!on_any(file != nullptr, world))
    error->all(FLERR, "{}: cannot write the file of events '{}': check the folder", who, name);
}

// How many bytes of a file of events are whole lines up to this step
static std::uintmax_t bytes_until(const std::string &name, bigint last_step)
{
  std::ifstream in(name, std::ios::binary);
  std::uintmax_t bytes = 0;
  for (std::string line; std::getline(in, line) && !in.eof(); bytes += line.size() + 1)
    if (line.compare(0, 1, "#") != 0 && std::strtoll(line.c_str(), nullptr, 10) > last_step) break;
  return bytes;
}

void EventFile::begin(bigint last_step)
{
  if (std::exchange(begun, true) || !file) return;
  const std::uintmax_t kept = last_step < 0 ? 0 : bytes_until(name, last_step);
  std::error_code failure;
  std::filesystem::resize_file(name, kept, failure);
  if (failure)
    error->one(FLERR, "{}: cannot write the file of events '{}': {}", who, name, failure.message());
  if (kept == 0) fputs("# step i j what x y z\n", file);
}

EventFile::~EventFile()
{
  if (file) fclose(file);
}

void EventFile::write(std::vector<BondEvent> &events)
{
  constexpr int WORDS = sizeof(BondEvent) / sizeof(double);    // counts of bytes would end at 2 GiB
  static_assert(sizeof(BondEvent) == WORDS * sizeof(double));
  int here = WORDS * (int) events.size();
  std::vector<int> sizes(comm->nprocs), places(comm->nprocs, 0);
  MPI_Gather(&here, 1, MPI_INT, sizes.data(), 1, MPI_INT, 0, world);
  for (int rank = 1; rank < comm->nprocs; rank++) places[rank] = places[rank - 1] + sizes[rank - 1];
  std::vector<BondEvent> all((places.back() + sizes.back()) / WORDS);
  MPI_Gatherv(events.data(), here, MPI_DOUBLE, all.data(), sizes.data(), places.data(), MPI_DOUBLE,
              0, world);
  events.clear();
  if (!file) return;

  std::sort(all.begin(), all.end(), [](const BondEvent &a, const BondEvent &b) {
    return std::tie(a.step, a.i, a.j) < std::tie(b.step, b.i, b.j);
  });
  for (const BondEvent &e : all)
    fputs(fmt::format("{} {} {} {} {:.8g} {:.8g} {:.8g}\n", e.step, e.i, e.j,
                      BondEvent::NAMES[e.why], e.place[0], e.place[1], e.place[2])
              .c_str(),
          file);
  if (fflush(file) != 0 || ferror(file))
    error->one(FLERR, "{}: cannot write the file of events: check the free space", who);
}

}    // namespace EVP
