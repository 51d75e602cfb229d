// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace EVP {

/// Words that this process was started with; none where the system does not tell.
std::vector<std::string> command_line();

/// The whole text of an open regular file of `most` bytes at most; its reader goes on where it was. False for anything else,
/// such as a pipe.
bool text_of(int descriptor, size_t most, std::string &text);

/// The texts of all files that are open for reading only, but for one: of the input scripts that include this one.
std::string open_texts(size_t most, int except);

}    // namespace EVP
