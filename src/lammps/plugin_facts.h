// SPDX-License-Identifier: GPL-2.0-only
/// What the plugin was built for, as text in its file: `evp doctor` reads it there, as a plugin that does not open cannot say it.
#pragma once

#include "lmptype.h"

#include <mpi.h>

#define EVP_TEXT_OF(value) #value
#define EVP_TEXT(macro) EVP_TEXT_OF(macro)

#ifndef EVP_VERSION
#define EVP_VERSION "unknown"
#endif

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

namespace {

[[gnu::used]] const char plugin_facts[] =
    "EVP plugin facts: version=" EVP_VERSION
    ";lammps=" EVP_TEXT(EVP_LAMMPS_VERSION) ";integers=" EVP_INTEGERS ";mpi=" EVP_MPI
                                            ";compiler=" EVP_COMPILER;

}    // namespace
