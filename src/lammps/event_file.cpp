// SPDX-License-Identifier: GPL-2.0-only

#include "event_file.h"

#include "collective.h"

#include "comm.h"
#include "error.h"

#include <algorithm>
#include <tuple>

namespace EVP {

EventFile::EventFile(LAMMPS *lmp, const std::string &who_in, const std::string &name) :
    Pointers(lmp), who(who_in)
{
  if (comm->me == 0) file = fopen(name.c_str(), "w");
  if (!on_any(file != nullptr, world))
    error->all(FLERR, "{}: cannot write the file of events '{}': check the folder", who, name);
  if (file) fputs("# step i j what x y z\n", file);
}

EventFile::~EventFile()
{
  if (file) fclose(file);
}

void EventFile::write(std::vector<BondEvent> &events)
{
  int here = (int) (events.size() * sizeof(BondEvent));
  std::vector<int> sizes(comm->nprocs), places(comm->nprocs, 0);
  MPI_Gather(&here, 1, MPI_INT, sizes.data(), 1, MPI_INT, 0, world);
  for (int rank = 1; rank < comm->nprocs; rank++) places[rank] = places[rank - 1] + sizes[rank - 1];
  std::vector<BondEvent> all((places.back() + sizes.back()) / sizeof(BondEvent));
  MPI_Gatherv(events.data(), here, MPI_BYTE, all.data(), sizes.data(), places.data(), MPI_BYTE, 0,
              world);
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
