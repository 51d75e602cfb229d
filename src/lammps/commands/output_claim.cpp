// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/output_claim.h"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace EVP {

namespace {

  class LockedFile {
   public:
    LockedFile() = default;
    LockedFile(const LockedFile &) = delete;
    LockedFile &operator=(const LockedFile &) = delete;
    ~LockedFile() { release(); }

    bool claim(const std::string &path)
    {
      struct stat own, there;
      if (fd >= 0 && fstat(fd, &own) == 0 && stat(path.c_str(), &there) == 0 && is_same(own, there))
        return true;
      for (;;) {
        const int opened = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (opened < 0) return true;
        if (flock(opened, LOCK_EX | LOCK_NB) != 0) {
          const bool is_taken = errno == EWOULDBLOCK;
          close(opened);
          return !is_taken;
        }
        // whoever had it may have removed it since it was opened
        if (fstat(opened, &own) == 0 && stat(path.c_str(), &there) == 0 && is_same(own, there)) {
          release();
          fd = opened;
          name = path;
          return true;
        }
        close(opened);
      }
    }

   private:
    int fd = -1;
    std::string name;    // absolute, as `shell cd` may follow

    static bool is_same(const struct stat &a, const struct stat &b)
    {
      return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
    }
    void release()
    {
      if (fd < 0) return;
      unlink(name.c_str());    // before others can lock it
      close(std::exchange(fd, -1));
    }
  };

}    // namespace

bool claim_output(const std::string &prefix)
{
  static LockedFile file;
  char folder[4096];
  const bool is_absolute = prefix[0] == '/' || !getcwd(folder, sizeof(folder));
  return file.claim((is_absolute ? "" : std::string(folder) + "/") + prefix + ".lock");
}

}    // namespace EVP
