#pragma once
// The messages of an MCAP file that have our own types, as an LCM log.

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/log/log_file.h"
#include "tools/mcap/mcap_reader.h"

namespace rcs::mcap {

struct ImportCounts {
  std::int64_t malformed = 0;                   ///< of our types, but not decodable
  std::int64_t bad_times = 0;                   ///< not in the range of a stamp
  std::map<std::string, std::int64_t> skipped;  ///< topics of other types: messages
};

/// Converts messages on topics /rcs/CHANNEL of type rcs_msgs/msg/X.
class LogImport {
 public:
  /// @param file  its name, in errors
  /// @param reader, writer  outlive the import
  LogImport(std::string file, const Reader* reader, LogWriter* writer)
      : file_(std::move(file)), reader_(*reader), writer_(*writer) {}

  /// @return an error if the type of the channel has changed since the file was written, or a
  ///   failure of the writer
  Outcome add(const Message& message);

  [[nodiscard]] const ImportCounts& counts() const { return counts_; }

 private:
  struct Source {
    std::string lcm_channel;  ///< empty: not of our types
    std::string topic;
  };
  Result<const Source*> source_of(std::uint16_t channel_id);

  std::string file_;
  const Reader& reader_;
  LogWriter& writer_;
  std::map<std::uint16_t, Source> sources_;  // by channel of the file
  ImportCounts counts_;
  std::vector<std::uint8_t> encoded_;
};

/// The bytes of LCM of a message in CDR.
/// @return false: the bytes are not of the type of the channel
[[nodiscard]] bool to_lcm(std::string_view channel, const std::uint8_t* cdr, std::size_t size,
                          std::vector<std::uint8_t>* out);

}  // namespace rcs::mcap
