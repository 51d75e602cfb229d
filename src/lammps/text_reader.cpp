// SPDX-License-Identifier: GPL-2.0-only

#include "text_reader.h"

#include <array>
#include <cerrno>
#include <cstdio>

EVP::Reading EVP::read_text(const std::string &path, int most, std::string &text, MPI_Comm world)
{
  int me;
  MPI_Comm_rank(world, &me);
  Reading reading = Reading::DONE;
  text.clear();
  if (me == 0) {
    FILE *const fp = fopen(path.c_str(), "rb");
    if (fp) {
      text.resize((size_t) most + 1);
      text.resize(fread(&text[0], 1, text.size(), fp));
      if (ferror(fp)) reading = Reading::FAILED;
      fclose(fp);
    } else
      reading = errno == ENOENT || errno == ENOTDIR ? Reading::MISSING : Reading::FAILED;
    if (reading == Reading::DONE && text.size() > (size_t) most) reading = Reading::TOO_LARGE;
    if (reading != Reading::DONE) text.clear();
  }
  std::array<int, 2> outcome = {(int) reading, (int) text.size()};
  MPI_Bcast(outcome.data(), 2, MPI_INT, 0, world);
  text.resize(outcome[1]);
  MPI_Bcast(&text[0], outcome[1], MPI_CHAR, 0, world);
  return (Reading) outcome[0];
}
