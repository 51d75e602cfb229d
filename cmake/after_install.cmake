# SPDX-License-Identifier: GPL-2.0-only
# After the last file is installed: adds the files, and the folders made for them, to EVP_RECORD.
# Not CMake's own manifest, which knows neither folders nor DESTDIR.
cmake_policy(VERSION 3.20)
set(EVP_MADE ${EVP_RECORDED})
foreach(path IN LISTS CMAKE_INSTALL_MANIFEST_FILES)
  set(path "${EVP_ROOT}${path}")
  while(NOT "${path}" IN_LIST EVP_THERE AND NOT "${path}" IN_LIST EVP_MADE)
    list(APPEND EVP_MADE "${path}")
    get_filename_component(path "${path}" DIRECTORY)
  endwhile()
endforeach()
list(SORT EVP_MADE)
list(JOIN EVP_MADE "\n" EVP_MADE)
file(WRITE "${EVP_RECORD}" "${EVP_MADE}\n")
message(STATUS "EVP: installed; `evp path plugin` prints the folder for LAMMPS_PLUGIN_PATH")
message(STATUS "EVP: to remove all of it: cmake --build ${EVP_BUILD_FOLDER} --target uninstall")
