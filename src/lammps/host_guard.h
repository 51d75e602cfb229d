// SPDX-License-Identifier: GPL-2.0-only
/// Refuses a LAMMPS that this plugin was not built for. LAMMPS itself does not: a plugin of another
/// release, MPI or integer size loads and then misreads memory. Only LAMMPS' C library API is asked,
/// because the layout of every C++ class is just what may differ.
#ifndef EVP_HOST_GUARD_H
#define EVP_HOST_GUARD_H

#include "exceptions.h"
#include "library.h"
#include "lmptype.h"

#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

// Internal linkage throughout: a second plugin in the process must run its own check, not the first one's.
namespace EVP {
namespace {

// MPIs with one binary interface have one name here (the MPICH ABI: MPICH, Intel MPI, MVAPICH, Cray).
#if defined(EVP_BUILT_MPI)
  const char built_mpi[] = EVP_BUILT_MPI;    // the tests forge a name
#elif defined(OPEN_MPI) && OMPI_MAJOR_VERSION >= 4
  const char built_mpi[] = "Open MPI 4 or later";
#elif defined(OPEN_MPI)
  const char built_mpi[] = "Open MPI before 4";
#elif defined(MPICH_VERSION) || defined(I_MPI_VERSION) || defined(MVAPICH2_VERSION)
  const char built_mpi[] = "MPICH";
#elif defined(MPI_STUBS)
  const char built_mpi[] = "no MPI";
#else
  const char built_mpi[] = "";    // unknown: only the size of MPI_Comm is compared
#endif

  inline std::string host_mpi()
  {
    // Longer than any MPI_MAX_LIBRARY_VERSION_STRING: the host's limit may be above the plugin's.
    std::vector<char> text(16384, '\0');
    int length = 0;
    if (MPI_Get_library_version(text.data(), &length) != MPI_SUCCESS) return "";
    const std::string name(text.data());

    if (name.find("LAMMPS MPI STUBS") != std::string::npos) return "no MPI";
    const std::size_t open = name.find("Open MPI v");
    if (open != std::string::npos)
      return std::atoi(name.c_str() + open + 10) >= 4 ? "Open MPI 4 or later" : "Open MPI before 4";
    for (const char *family : {"MPICH", "Intel(R) MPI", "MVAPICH", "CRAY MPICH"})
      if (name.find(family) != std::string::npos) return "MPICH";
    return name.substr(0, name.find('\n'));
  }

  inline bool same_release(int host)
  {
    // A development version of LAMMPS counts one day more than its version.h says.
    return host == EVP_LAMMPS_VERSION || host == EVP_LAMMPS_VERSION + 1;
  }

  inline std::string differences(void *lmp)
  {
    std::string text;
    const auto add = [&text](const std::string &built_for, const std::string &found) {
      text += (text.empty() ? "" : "; ") + built_for + ", not " + found;
    };

    const int version = lammps_version(lmp);
    if (!same_release(version))
      add("release " + std::to_string(EVP_LAMMPS_VERSION), std::to_string(version));

    const struct {
      const char *name;
      int bytes;
    } integers[] = {{"bigint", int(sizeof(LAMMPS_NS::bigint))},
                    {"tagint", int(sizeof(LAMMPS_NS::tagint))},
                    {"imageint", int(sizeof(LAMMPS_NS::imageint))}};
    for (const auto &integer : integers) {
      const int host = lammps_extract_setting(lmp, integer.name);
      if (host != integer.bytes)
        add(std::string(integer.name) + " of " + std::to_string(8 * integer.bytes) + " bits",
            std::to_string(8 * host));
    }

    // Asked first: with another MPI_Comm the call below would go to a library of unknown kind.
    const int host_comm = lammps_config_has_mpi_support();
    const bool built_without = std::string(built_mpi) == "no MPI";
    const int built_comm = built_without ? 0 : int(sizeof(MPI_Comm));
    const std::string found = host_mpi();
    if (built_mpi[0] && found != built_mpi)
      add(std::string("MPI ") + built_mpi, found);
    else if (host_comm != built_comm)
      add("MPI communicators of " + std::to_string(built_comm) + " bytes",
          std::to_string(host_comm));
    return text;
  }

  /// Does the host turn exceptions of LAMMPS into errors of its own, on all ranks that load the plugin?
  inline bool catches_exceptions(void *lmp)
  {
    // with several partitions one may be the only one that loads it
    return lammps_config_has_exceptions() &&
        lammps_extract_setting(lmp, "world_size") == lammps_extract_setting(lmp, "universe_size");
  }

  /// Returns if the plugin was built for the LAMMPS instance `lmp`; otherwise says once what differs and
  /// what to rebuild, and stops as an error of LAMMPS does: a program that uses LAMMPS as a library goes on.
  inline void refuse_wrong_host(void *lmp)
  {
    const std::string what = differences(lmp);
    if (what.empty()) return;
    const std::string text = "ERROR: evpplugin.so was built for another LAMMPS: " + what +
        ". Rebuild the plugin for this LAMMPS: cmake -S . -B build "
        "-DLAMMPS_SOURCE_DIR=/path/to/its/source -DLAMMPS_BUILD_DIR=/path/to/its/build "
        "&& cmake --build build\n";

    const bool first = lammps_extract_setting(lmp, "universe_rank") == 0;
    std::fflush(stdout);
    if (first) std::fprintf(stderr, "\n%s", text.c_str());

    // Not by Error, whose layout may differ. This class consists of its text in every release.
    if (catches_exceptions(lmp)) throw LAMMPS_NS::LAMMPSException(text);

    // No MPI call here, it may be the wrong MPI. The others leave a moment later, since mpirun may end
    // the job at the first exit and the message must be out by then.
    if (!first) std::this_thread::sleep_for(std::chrono::seconds(1));
    // Not exit(): destructors of a library that does not fit are not to be run.
    std::fflush(nullptr);
    std::_Exit(EXIT_FAILURE);
  }

}    // namespace
}    // namespace EVP

#endif
