# SPDX-License-Identifier: GPL-2.0-only
# The MPI headers of the host: its own MPI, or LAMMPS' one-process stand-in. Sets EVP_MPI_INCLUDE, EVP_MPI_NAME.
option(BUILD_MPI "LAMMPS has MPI; asked only where its build or installation does not tell" ON)
if(EVP_HOST_MPI STREQUAL "")
  set(EVP_HOST_MPI ${BUILD_MPI})
endif()

if(EVP_HOST_MPI)
  # The compiler wrapper that LAMMPS was built with, so that two MPIs on one machine are not mixed.
  if(EVP_BUILD_MPICXX AND NOT MPI_CXX_COMPILER)
    set(MPI_CXX_COMPILER "${EVP_BUILD_MPICXX}" CACHE FILEPATH "MPI compiler wrapper of LAMMPS")
  endif()
  set(MPI_CXX_SKIP_MPICXX TRUE)
  find_package(MPI COMPONENTS CXX QUIET)
  if(NOT MPI_CXX_FOUND)
    message(FATAL_ERROR "LAMMPS uses MPI, but no MPI headers were found. Install them (Debian: libopenmpi-dev), or give -DMPI_CXX_COMPILER=/path/to/mpicxx of the MPI that LAMMPS was built with.")
  endif()
  set(EVP_MPI_INCLUDE ${MPI_CXX_INCLUDE_DIRS})
  set(EVP_MPI_NAME "MPI from ${MPI_CXX_COMPILER}")
else()
  if(NOT EXISTS "${EVP_HOST_INCLUDE}/STUBS/mpi.h")
    message(FATAL_ERROR "LAMMPS was built without MPI, and ${EVP_HOST_INCLUDE} does not hold its stand-in STUBS/mpi.h. ${EVP_HOW}")
  endif()
  set(EVP_MPI_INCLUDE "${EVP_HOST_INCLUDE}/STUBS")
  set(EVP_MPI_NAME "no MPI")
endif()

string(TOUPPER "LAMMPS_${EVP_HOST_SIZES}" EVP_HOST_SIZES_DEFINITION)
