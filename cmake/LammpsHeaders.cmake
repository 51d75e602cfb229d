# SPDX-License-Identifier: GPL-2.0-only
# Included by LAMMPS' own CMake when tools/setup.sh builds it: the headers that nearly every source includes are parsed
# once.
if(CMAKE_VERSION VERSION_LESS 3.19)
  return()
endif()
set(headers pointers atom comm domain error force memory modify neighbor update)
list(TRANSFORM headers REPLACE "(.+)" "$<$<COMPILE_LANGUAGE:CXX>:<\\1.h$<ANGLE-R>>")
cmake_language(EVAL CODE "cmake_language(DEFER CALL target_precompile_headers lammps PRIVATE [[${headers}]])")
