// SPDX-License-Identifier: GPL-2.0-only

#include "own_process.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

std::vector<std::string> EVP::command_line()
{
  std::vector<std::string> words;
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  return words;
}

bool EVP::text_of(int descriptor, size_t most, std::string &text)
{
  struct stat state;
  if (fstat(descriptor, &state) != 0 || !S_ISREG(state.st_mode) || (size_t) state.st_size > most)
    return false;
  text.resize(state.st_size);
  size_t done = 0;
  for (ssize_t count; done < text.size(); done += count) {
    count = pread(descriptor, &text[done], text.size() - done, (off_t) done);
    if (count <= 0) return false;
  }
  return true;
}

std::string EVP::open_texts(size_t most, int except)
{
  std::string texts, text;
  const int end = (int) std::clamp(sysconf(_SC_OPEN_MAX), 0L, 1024L);
  for (int descriptor = 0; descriptor < end; descriptor++) {
    const int mode = descriptor == except ? -1 : fcntl(descriptor, F_GETFL);
    if (mode != -1 && (mode & O_ACCMODE) == O_RDONLY && text_of(descriptor, most, text))
      texts += text + "\n";
  }
  return texts;
}
