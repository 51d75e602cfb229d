# SPDX-License-Identifier: GPL-2.0-only
# The command build/evp, and what `cmake --install` and the target uninstall do: doc/install.rst.
# All is found relative to the command evp, so that a tree can be moved, and DESTDIR used.
include(GNUInstallDirs)
set(EVP_PLUGIN_FOLDER lib/lammps/plugins CACHE STRING "folder below the prefix that the plugin is installed into; LAMMPS_PLUGIN_PATH names it")
set(EVP_SHARE_FOLDER ${CMAKE_INSTALL_DATADIR}/evp)
set(EVP_LMP_FOLDER ${CMAKE_INSTALL_LIBEXECDIR}/evp)
set(EVP_PROGRAM_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

# evp_from(OUT FROM TO): shell words for folder TO as seen from the script in FROM, which knows itself as $here.
function(evp_from out from to)
  foreach(folder from to)
    cmake_path(ABSOLUTE_PATH ${folder} BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX} NORMALIZE)
  endforeach()
  file(RELATIVE_PATH relative ${from} ${to})
  set(${out} "\"$here\"'/${relative}'" PARENT_SCOPE)
endfunction()

set(EVP_SHARE "'${CMAKE_CURRENT_SOURCE_DIR}'")
set(EVP_LMP "'${CMAKE_CURRENT_BINARY_DIR}/lmp'")
set(EVP_PLUGINS "'${CMAKE_CURRENT_BINARY_DIR}'")
configure_file(cmake/evp.in evp @ONLY FILE_PERMISSIONS ${EVP_PROGRAM_PERMISSIONS})

evp_from(EVP_SHARE ${CMAKE_INSTALL_BINDIR} ${EVP_SHARE_FOLDER})
evp_from(EVP_LMP ${CMAKE_INSTALL_BINDIR} ${EVP_LMP_FOLDER}/lmp)
evp_from(EVP_PLUGINS ${CMAKE_INSTALL_BINDIR} ${EVP_PLUGIN_FOLDER})
set(EVP_MOVED "a part of its installation is missing: install EVP again, or move all of its prefix")
configure_file(cmake/evp.in installed/evp @ONLY FILE_PERMISSIONS ${EVP_PROGRAM_PERMISSIONS})
evp_from(EVP_PLUGINS ${EVP_LMP_FOLDER} ${EVP_PLUGIN_FOLDER})
configure_file(cmake/lmp_installed.in installed/lmp @ONLY FILE_PERMISSIONS ${EVP_PROGRAM_PERMISSIONS})

# The tools for users; the others write the pages and check the sources, and need the source tree.
set(EVP_TOOLS_LIST ${CMAKE_CURRENT_SOURCE_DIR}/tools/evp/__main__.py)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${EVP_TOOLS_LIST})
file(STRINGS ${EVP_TOOLS_LIST} EVP_TOOLS REGEX "^FOR_USERS = ")
if(NOT EVP_TOOLS MATCHES "^FOR_USERS = \"([a-z_ ]+)\"")
  message(FATAL_ERROR "${EVP_TOOLS_LIST} must have one line of the form: FOR_USERS = \"NAME NAME ...\".split()")
endif()
string(REPLACE " " ";" EVP_TOOLS "${CMAKE_MATCH_1}")
list(TRANSFORM EVP_TOOLS REPLACE "(.+)" "tools/\\1.py")
file(GLOB EVP_PROGRAMS CONFIGURE_DEPENDS ${EVP_TOOLS})
file(GLOB EVP_PAGES CONFIGURE_DEPENDS README.md LICENSE CHANGELOG.md CITATION.cff)

set(EVP_RECORD ${CMAKE_CURRENT_BINARY_DIR}/installed.txt)
set(EVP_FOLDERS ${CMAKE_INSTALL_BINDIR} ${EVP_PLUGIN_FOLDER} ${EVP_LMP_FOLDER} ${EVP_SHARE_FOLDER})
install(CODE "set(EVP_RECORD \"${EVP_RECORD}\")\nset(EVP_FOLDERS \"${EVP_FOLDERS}\")\nset(EVP_BUILD_FOLDER \"${CMAKE_CURRENT_BINARY_DIR}\")")
install(SCRIPT cmake/before_install.cmake)
install(TARGETS evpplugin LIBRARY DESTINATION ${EVP_PLUGIN_FOLDER})
install(PROGRAMS ${CMAKE_CURRENT_BINARY_DIR}/installed/evp DESTINATION ${CMAKE_INSTALL_BINDIR})
install(PROGRAMS ${CMAKE_CURRENT_BINARY_DIR}/installed/lmp DESTINATION ${EVP_LMP_FOLDER})
install(PROGRAMS ${EVP_PROGRAMS} DESTINATION ${EVP_SHARE_FOLDER}/tools)
# For the doctor's remedies, which use it only where these folders still exist.
set(EVP_FROM ${CMAKE_CURRENT_BINARY_DIR}/installed/installed_from.txt)
file(WRITE ${EVP_FROM} "source=${CMAKE_CURRENT_SOURCE_DIR}\nbuild=${CMAKE_CURRENT_BINARY_DIR}\n")
install(FILES ${EVP_FROM} DESTINATION ${EVP_SHARE_FOLDER})
install(FILES ${EVP_PAGES} DESTINATION ${EVP_SHARE_FOLDER})
# What runs and tools leave in these folders stays there.
set(EVP_LEFTOVERS PATTERN __pycache__ EXCLUDE PATTERN "*.pyc" EXCLUDE PATTERN "log.*" EXCLUDE PATTERN ".*" EXCLUDE PATTERN "_*" EXCLUDE PATTERN studies EXCLUDE)
install(DIRECTORY lammps_inputs potentials doc DESTINATION ${EVP_SHARE_FOLDER} ${EVP_LEFTOVERS})
file(GLOB EVP_MODULES CONFIGURE_DEPENDS tools/evp/*.py)
install(FILES ${EVP_MODULES} DESTINATION ${EVP_SHARE_FOLDER}/tools/evp)
install(SCRIPT cmake/after_install.cmake)

add_custom_target(uninstall COMMAND ${CMAKE_COMMAND} -DEVP_RECORD=${EVP_RECORD} -P ${CMAKE_CURRENT_SOURCE_DIR}/cmake/uninstall.cmake VERBATIM)
