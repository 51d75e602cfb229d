// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/base/atom_directory.h"

#include "lammps/base/collective.h"

#include "atom.h"
#include "comm.h"
#include "memory.h"

#include <cstdint>

namespace EVP {

namespace {

  /// An atom, or the question for one, which has type 0.
  struct Message {
    tagint id;
    int sender;
    AtomDirectory::Entry atom;
  };

  struct Answering {
    Memory *memory;
    tagint twice;
  };

  // Called by LAMMPS on the rank that answers for these IDs: returns the questions, with the atoms, to the senders.
  int answer(int n, char *received, int &flag, int *&ranks, char *&sent, void *ptr)
  {
    auto *self = (Answering *) ptr;
    auto *messages = (Message *) received;
    std::unordered_map<tagint, AtomDirectory::Entry> atoms;
    for (const Message *m = messages; m != messages + n; m++)
      if (m->atom.type && !atoms.insert({m->id, m->atom}).second) self->twice = m->id;

    self->memory->create(ranks, n, "evp/bonds:ranks");
    int answers = 0;
    for (const Message *m = messages; m != messages + n; m++) {
      const auto at = atoms.find(m->id);
      if (m->atom.type || at == atoms.end()) continue;
      ranks[answers] = m->sender;
      messages[answers++] = {m->id, m->sender, at->second};
    }
    flag = 1;    // the answers are in the memory of what was received
    sent = received;
    return answers;
  }

}    // namespace

AtomDirectory::AtomDirectory(LAMMPS *lmp, const std::vector<tagint> &ids, const double *values)
{
  const Atom *atom = lmp->atom;
  const int me = lmp->comm->me;
  std::vector<Message> messages;
  for (int i = 0; i < atom->nlocal; i++)
    messages.push_back(
        {atom->tag[i], me, {atom->type[i], atom->radius[i], values ? values[i] : 0.0}});
  for (const tagint id : ids)
    if (entries.insert({id, {}}).second) messages.push_back({id, me, {}});

  // IDs that are multiples of a number are common: their hashes are not
  std::vector<int> ranks;
  for (const Message &m : messages)
    ranks.push_back((int) ((((uint64_t) m.id * 0x9E3779B97F4A7C15ULL) >> 33) % lmp->comm->nprocs));

  Answering answering = {lmp->memory, 0};
  char *buffer = nullptr;
  const int n =
      lmp->comm->rendezvous(1, (int) messages.size(), (char *) messages.data(), sizeof(Message), 0,
                            ranks.data(), answer, 0, buffer, sizeof(Message), &answering);
  const auto *answers = (Message *) buffer;
  for (int k = 0; k < n; k++) entries[answers[k].id] = answers[k].atom;
  lmp->memory->sfree(buffer);
  twice = reduce_all(answering.twice, MPI_MAX, lmp->world);
}

}    // namespace EVP
