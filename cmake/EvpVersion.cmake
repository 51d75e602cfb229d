# SPDX-License-Identifier: GPL-2.0-only
# Sets EVP_VERSION from tools/evp/__init__.py, the one place that has it.
set(EVP_VERSION_FILE ${CMAKE_CURRENT_SOURCE_DIR}/tools/evp/__init__.py)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${EVP_VERSION_FILE})
file(STRINGS ${EVP_VERSION_FILE} EVP_VERSION REGEX "^__version__ = ")
if(NOT EVP_VERSION MATCHES "^__version__ = \"([0-9]+\\.[0-9]+\\.[0-9]+)\"")
  message(FATAL_ERROR "${EVP_VERSION_FILE} must have one line of the form: __version__ = \"1.0.0\"")
endif()
set(EVP_VERSION ${CMAKE_MATCH_1})
