// SPDX-License-Identifier: GPL-2.0-only
/// Refuses a LAMMPS that this plugin was not built for. LAMMPS itself does not: a plugin of another
/// release, integer size or kind of MPI loads and then misreads memory. Only LAMMPS' C library API is called,
/// because the layout of every C++ class may differ, and MPI not at all.
#pragma once

#include "exceptions.h"
#include "library.h"
#include "lmptype.h"

#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>

#ifndef EVP_MPI_COMM_BYTES    // the tests forge it
#ifdef MPI_STUBS
#define EVP_MPI_COMM_BYTES 0
#else
#define EVP_MPI_COMM_BYTES sizeof(MPI_Comm)
#endif
#endif

#define EVP_TEXT_OF(value) #value
#define EVP_TEXT(macro) EVP_TEXT_OF(macro)

#ifdef LAMMPS_BIGBIG
#define EVP_INTEGERS "bigbig"
#else
#define EVP_INTEGERS "smallbig"
#endif

#if defined(MPI_STUBS)
#define EVP_MPI "none"
#elif defined(MPICH_VERSION)
#define EVP_MPI "MPICH " MPICH_VERSION
#elif defined(OMPI_MAJOR_VERSION)
#define EVP_MPI                                                                           \
  "Open MPI " EVP_TEXT(OMPI_MAJOR_VERSION) "." EVP_TEXT(OMPI_MINOR_VERSION) "." EVP_TEXT( \
      OMPI_RELEASE_VERSION)
#else
#define EVP_MPI "unknown"
#endif

#ifdef __clang__
#define EVP_COMPILER "clang++ " __clang_version__
#else
#define EVP_COMPILER "g++ " __VERSION__
#endif

// Internal linkage: a second plugin in the process must run its own check, not the first one's.
namespace {

/// What the plugin was built for, as text in its file: `evp doctor` reads it there, as a plugin that does not open cannot say it.
[[gnu::used]] const char plugin_facts[] =
    "EVP plugin facts: version=" EVP_VERSION
    ";lammps=" EVP_TEXT(EVP_LAMMPS_VERSION) ";integers=" EVP_INTEGERS ";mpi=" EVP_MPI
                                            ";compiler=" EVP_COMPILER;

/// Returns if the plugin was built for the LAMMPS instance `lmp`; otherwise the first rank of this partition says what
/// differs, and stops as an error of LAMMPS does: a program that uses LAMMPS as a library goes on.
void refuse_wrong_host(void *lmp)
{
  std::string text;
  const auto compare = [&text](const char *what, int built, int host, const char *unit) {
    if (host != built)
      text += (text.empty() ? "" : "; ") + (what + std::to_string(built)) + ", not " +
          std::to_string(host) + unit;
  };
  // a development version of LAMMPS counts one day more than its version.h says
  const int version = lammps_version(lmp);
  if (version != EVP_LAMMPS_VERSION + 1) compare("release ", EVP_LAMMPS_VERSION, version, "");
  for (const auto &[key, size] :
       {std::pair("bigint", sizeof(LAMMPS_NS::bigint)), {"tagint", sizeof(LAMMPS_NS::tagint)}})
    compare((key + std::string(" of ")).c_str(), (int) size, lammps_extract_setting(lmp, key),
            " bytes");
  compare("MPI_Comm of ", EVP_MPI_COMM_BYTES, lammps_config_has_mpi_support(),
          " bytes (MPICH: 4, Open MPI: 8, no MPI: 0)");
  if (text.empty()) return;
  text = "ERROR: evpplugin.so was built for another LAMMPS: " + text +
      ". Rebuild the plugin for this LAMMPS: cmake -S . -B build "
      "-DLAMMPS_SOURCE_DIR=/path/to/its/source -DLAMMPS_BUILD_DIR=/path/to/its/build "
      "&& cmake --build build\n";
  const bool first = lammps_extract_setting(lmp, "world_rank") == 0;
  if (first) std::fprintf(stderr, "\n%s", text.c_str());

  // Not by Error, whose layout may differ: this class consists of its text in every release. With several
  // partitions one may be alone in loading the plugin, and the others would wait for it for ever.
  if (lammps_config_has_exceptions() &&
      lammps_extract_setting(lmp, "world_size") == lammps_extract_setting(lmp, "universe_size"))
    throw LAMMPS_NS::LAMMPSException(text);
  // the message must be out before mpirun ends the job at the first exit; destructors of a library that does not fit
  // are not to be run
  if (!first) std::this_thread::sleep_for(std::chrono::seconds(1));
  std::fflush(nullptr);
  std::_Exit(EXIT_FAILURE);
}

}    // namespace
