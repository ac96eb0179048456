#pragma once
// Exit status of every program.

namespace rcs {

constexpr int kExitOk = 0;
constexpr int kExitNegative = 1;       ///< the work is done, and its result is negative
constexpr int kExitUsage = 2;          ///< invalid command line
constexpr int kExitInput = 3;          ///< a file, the network or the system prevented the work
constexpr int kExitInterrupted = 130;  ///< Ctrl-C or SIGTERM before the work was done

/// For --help; read by tools/rcs/reference, too.
inline constexpr char kExitStatusHelp[] =
    "Exit status: 0 done; 1 the result is negative: a drill failed, a map is broken, the vehicle\n"
    "did not arrive; 2 invalid command line; 3 a file, the network or the system prevented the\n"
    "work: an input is missing or invalid, an output cannot be written; 130 interrupted (Ctrl-C,\n"
    "SIGTERM) before the end.";

}  // namespace rcs
