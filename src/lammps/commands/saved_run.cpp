// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/saved_run.h"

#include <filesystem>
#include <fstream>

namespace EVP {

namespace {

  // with which LAMMPS ends a restart file (its lmprestart.h, which an installed LAMMPS lacks): one that was killed as it wrote has not
  constexpr char MAGIC[] = "LammpS RestartT";

  bool is_whole(const std::string &path)
  {
    const std::string end(MAGIC, sizeof(MAGIC));
    std::string found(end.size(), ' ');
    std::ifstream file(path, std::ios::binary);
    file.seekg(-(std::streamoff) end.size(), std::ios::end);
    return file.read(found.data(), (std::streamsize) found.size()) && found == end;
  }

}    // namespace

SavedRun read_saved_run(const std::string &prefix)
{
  SavedRun saved;
  std::ifstream file(prefix + ".resume");
  if (std::getline(file, saved.choices)) saved.choices.erase(0, 2);
  std::filesystem::file_time_type newest;
  for (int k = 0; k < 2; k++) {
    const std::string path = prefix + "." + std::to_string(k) + ".restart";
    if (!is_whole(path)) continue;
    std::error_code error;
    const auto time = std::filesystem::last_write_time(path, error);
    if (error || (saved.state >= 0 && time < newest)) continue;
    saved.state = k;
    newest = time;
  }
  return saved;
}

}    // namespace EVP
