# cmake -DIN=raw.hpp -DOUT=hardened.hpp -P harden.cmake
# lcm-gen's C++ decoders accept every length in a message: they throw on a negative one, allocate
# gigabytes from a 44-byte packet and crash on a string of length INT_MIN. The hardened decoders
# bound each length by the number of bytes left (an element has at least one byte).
file(READ "${IN}" text)

string(REGEX REPLACE
  "([ \t]*)this->([a-z0-9_]+)\\.resize\\(this->([a-z0-9_]+)\\);"
  "\\1if (this->\\3 < 0 || this->\\3 > maxlen - pos) return -1;\n\\1this->\\2.resize(static_cast<std::size_t>(this->\\3));"
  text "${text}")
string(REGEX REPLACE
  "if\\((__[a-z0-9_]+_len__) > maxlen - pos\\) return -1;"
  "if (\\1 < 1 || \\1 > maxlen - pos) return -1;"
  text "${text}")

# A string ends at its only NUL: the encoder stops at the first, so a message with a second one could
# not be forwarded.
string(REGEX REPLACE
  "([ \t]*)this->([][a-z0-9_]+)\\.assign\\(\\(\\(const char\\*\\)buf\\) \\+ offset \\+ pos, (__[a-z0-9_]+_len__) - 1\\);"
  "\\1if (memchr((const char*)buf + offset + pos, 0, (size_t)\\3) != (const char*)buf + offset + pos + \\3 - 1) return -1;\n\\1this->\\2.assign(((const char*)buf) + offset + pos, \\3 - 1);"
  text "${text}")

# An unknown form of the generator's output must fail the build, not remain unhardened.
string(REGEX MATCHALL "\\.resize\\(" resizes "${text}")
string(REGEX MATCHALL "\\.resize\\(static_cast<std::size_t>" hardened "${text}")
list(LENGTH resizes n_resizes)
list(LENGTH hardened n_hardened)
string(REGEX MATCHALL "\\.assign\\(" strings "${text}")
string(REGEX MATCHALL "_len__ < 1 \\|\\| " string_guards "${text}")
string(REGEX MATCHALL "memchr\\(" string_ends "${text}")
list(LENGTH strings n_strings)
list(LENGTH string_guards n_string_guards)
list(LENGTH string_ends n_string_ends)
if(NOT n_resizes EQUAL n_hardened OR NOT n_strings EQUAL n_string_guards OR
   NOT n_strings EQUAL n_string_ends)
  message(FATAL_ERROR "${IN}: lcm-gen's output has a form that harden.cmake does not handle")
endif()

file(WRITE "${OUT}" "${text}")
