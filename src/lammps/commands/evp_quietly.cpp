// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/evp_quietly.h"

#include "lammps/base/script_variables.h"
#include "lammps/base/user_input.h"

#include "input.h"
#include "variable.h"

#include <string>

using namespace LAMMPS_NS;
using namespace EVP;

namespace {

// Atoms that are minimized move without such a fix, but LAMMPS warns at each 'run 0'.
constexpr const char *HARMLESS = "No fixes with time integration";

/// While it lives, only warnings, what EVP says, and all that follows an error, come to the screen: at once, as another MPI rank
/// may end this one.
class HiddenScreen {
 public:
  HiddenScreen(FILE *&screen_in, Error *error_in) :
      screen(screen_in), shown(screen_in), hidden(shown ? open() : nullptr), error(error_in)
  {
    if (shown) fflush(shown);    // what was printed before a command that may take long
    if (!hidden) return;         // all is shown
    setvbuf(hidden, nullptr, _IOLBF, BUFSIZ);
    screen = hidden;
  }
  ~HiddenScreen()
  {
    screen = shown;
    if (!hidden) return;
    fclose(hidden);
    if (!line.empty()) show();
  }
  HiddenScreen(const HiddenScreen &) = delete;
  HiddenScreen &operator=(const HiddenScreen &) = delete;

 private:
  FILE *&screen;
  FILE *const shown, *const hidden;
  Error *const error;
  std::string line;    // that is not whole yet
  bool failed = false;

  FILE *open()
  {
#if defined(__linux__)
    cookie_io_functions_t functions = {};
    functions.write = [](void *self, const char *text, size_t size) {
      static_cast<HiddenScreen *>(self)->add(text, size);
      return (ssize_t) size;
    };
    return fopencookie(this, "w", functions);
#else
    const auto write = [](void *self, const char *text, int size) {
      static_cast<HiddenScreen *>(self)->add(text, (size_t) size);
      return size;
    };
    return funopen(this, nullptr, write, nullptr, nullptr);
#endif
  }
  void add(const char *text, size_t size)
  {
    for (const char *c = text; c < text + size; c++) {
      line += *c;
      if (*c == '\n') show();
    }
  }
  void show()
  {
    failed = failed || utils::strmatch(line, "^ERROR");
    bool warns = utils::strmatch(line, "^WARNING");
    if (warns && line.find(HARMLESS) != std::string::npos) {
      warns = false;
      error->set_numwarn(error->get_numwarn() - 1);    // LAMMPS shows the first hundred
    }
    const bool ours = utils::strmatch(line, "^evp/lj:") || utils::strmatch(line, "^pair evp/lj:") ||
        utils::strmatch(line, "^fix evp/");
    if (failed || warns || ours) {
      fputs(line.c_str(), shown);
      fflush(shown);
    }
    line.clear();
  }
};

std::string in_quotes(const std::string &word)
{
  if (!word.empty() && word.find_first_of(" \t#&$") == std::string::npos) return word;
  return "\"" + word + "\"";
}

}    // namespace

void EVPQuietly::command(int narg, char **arg)
{
  if (narg < 1) error->all(FLERR, "evp_quietly: expected a command and its arguments");
  // LAMMPS replaces letters outside ASCII in a line, but not in the variables of it
  std::string line, words;
  for (int i = 0; i < narg; i++) {
    std::string word = arg[i];
    if (utils::has_utf8(word) && in_quotes(word) == word) {
      const std::string name = "evp_quietly_" + std::to_string(i);
      set_script_variable(lmp, "evp_quietly", name, arg[i], "rename it");
      word = "${" + name + "}";
      words += " " + name;
    } else
      word = in_quotes(word);
    line += word + " ";
  }

  const HiddenScreen until_it_ends(lmp->screen, error);
  input->one(line);
  for (const std::string &name : split_words(words)) input->variable->set(name + " delete");
}
