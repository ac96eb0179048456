#pragma once
// Exit status of every program.

namespace rcs {

constexpr int kExitOk = 0;
constexpr int kExitNegative = 1;       ///< the work is done, and its result is negative
constexpr int kExitUsage = 2;          ///< invalid command line
constexpr int kExitInput = 3;          ///< a file, the network or the system prevented the work
constexpr int kExitInterrupted = 130;  ///< Ctrl-C or SIGTERM before the work was done

/// For --help.
inline constexpr char kExitStatusHelp[] =
    "Exit status:\n"
    "  0    done\n"
    "  1    the result is negative: a drill failed, a map is broken, the vehicle did not arrive\n"
    "  2    invalid command line\n"
    "  3    a file, the network or the system prevented the work: an input is missing or invalid,\n"
    "       an output cannot be written\n"
    "  130  interrupted (Ctrl-C, SIGTERM) before the end";

}  // namespace rcs
