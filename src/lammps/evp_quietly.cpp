// SPDX-License-Identifier: GPL-2.0-only

#include "evp_quietly.h"

#include "error.h"
#include "input.h"

#include <cstring>
#include <string>

using namespace LAMMPS_NS;

namespace {

// A minimization moves atoms without such a fix, but LAMMPS warns each time.
constexpr const char *HARMLESS = "No fixes with time integration";

/// While it lives, the screen is a temporary file. Then its warnings, and all that follows an error, are shown.
class HiddenScreen {
 public:
  explicit HiddenScreen(FILE *&screen_in) :
      screen(screen_in), shown(screen_in), hidden(shown ? tmpfile() : nullptr)
  {
    screen = hidden;
  }
  ~HiddenScreen()
  {
    screen = shown;
    if (!hidden) return;
    rewind(hidden);
    char line[512];
    for (bool failed = false; fgets(line, sizeof(line), hidden);) {
      if (strncmp(line, "ERROR", 5) == 0) failed = true;
      const bool warns = strncmp(line, "WARNING", 7) == 0 && !strstr(line, HARMLESS);
      if (failed || warns) fputs(line, shown);
    }
    fflush(shown);
    fclose(hidden);
  }
  HiddenScreen(const HiddenScreen &) = delete;
  HiddenScreen &operator=(const HiddenScreen &) = delete;

 private:
  FILE *&screen;
  FILE *const shown, *const hidden;
};

std::string quoted(const std::string &word)
{
  if (!word.empty() && word.find_first_of(" \t#&$") == std::string::npos) return word;
  return "\"" + word + "\"";
}

}    // namespace

void EVPQuietly::command(int narg, char **arg)
{
  if (narg < 1) error->all(FLERR, "evp_quietly: expected a command and its arguments");
  std::string line;
  for (int i = 0; i < narg; i++) line += quoted(arg[i]) + " ";

  const HiddenScreen until_it_ends(lmp->screen);
  input->one(line);
}
