#include "tools/view/browser.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

namespace rcs::view {
namespace {

constexpr const char* kPrograms[] = {"chromium", "chromium-browser", "google-chrome",
                                     "google-chrome-stable"};

/// "": none is installed.
std::string find_browser() {
  const char* variable = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): one thread
  for (const char* program : kPrograms) {
    std::string_view path = variable == nullptr ? "/usr/bin" : variable;
    while (!path.empty()) {
      const std::string_view folder = path.substr(0, path.find(':'));
      path.remove_prefix(std::min(folder.size() + 1, path.size()));
      std::string candidate = fmt::format("{}/{}", folder, program);
      if (access(candidate.c_str(), X_OK) == 0) return candidate;
    }
  }
  return "";
}

std::vector<std::string> arguments_of(const std::string& program, const std::string& profile) {
  std::vector<std::string> arguments = {
      program, "--headless=new", "--remote-debugging-pipe", "--user-data-dir=" + profile,
      // Pictures are the same on every computer, and no graphics card is needed.
      "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
      "--force-device-scale-factor=1", "--hide-scrollbars", "--mute-audio", "--no-first-run",
      "--no-default-browser-check", "--disable-extensions",
      // Nothing but the viewer's own address can be reached.
      "--disable-background-networking", "--disable-component-update", "--disable-sync",
      "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--no-proxy-server"};
  if (geteuid() == 0) arguments.emplace_back("--no-sandbox");  // Chromium requires it for root
  arguments.emplace_back("about:blank");
  return arguments;
}

/// Runs between fork and exec. Chromium reads from descriptor 3 and writes to 4.
[[noreturn]] void become(char* const* argv, int from_parent, int to_parent) {
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  (void)setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  (void)sigprocmask(SIG_SETMASK, &none, nullptr);
  // Above 4, so that the next two calls overwrite neither.
  const int input = fcntl(from_parent, F_DUPFD, 10);
  const int output = fcntl(to_parent, F_DUPFD, 10);
  (void)dup2(input, 3);
  (void)dup2(output, 4);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  (void)dup2(nothing, STDIN_FILENO);
  (void)dup2(nothing, STDOUT_FILENO);
  (void)dup2(nothing, STDERR_FILENO);
  (void)close_range(5, ~0U, CLOSE_RANGE_CLOEXEC);
  execv(argv[0], argv);
  _exit(127);
}

Error system_error(const char* what) { return {fmt::format("{}: {}", what, std::strerror(errno))}; }

}  // namespace

Result<std::unique_ptr<Browser>> Browser::start(boost::asio::io_context* io) {
  const std::string program = find_browser();
  if (program.empty()) {
    return Error{
        "no chromium or google-chrome in PATH, which makes the picture; install it: apt-get "
        "install "
        "chromium"};
  }
  std::string profile = (std::filesystem::temp_directory_path() / "rcs_view_XXXXXX").string();
  if (mkdtemp(profile.data()) == nullptr) return system_error("cannot create a profile folder");
  std::array<int, 2> to{};
  std::array<int, 2> from{};
  if (pipe2(to.data(), O_CLOEXEC) != 0) return system_error("cannot create a pipe");
  if (pipe2(from.data(), O_CLOEXEC) != 0) {
    (void)::close(to[0]);
    (void)::close(to[1]);
    return system_error("cannot create a pipe");
  }
  std::vector<std::string> arguments = arguments_of(program, profile);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) become(argv.data(), to[0], from[1]);
  const int fork_error = errno;
  (void)::close(to[0]);
  (void)::close(from[1]);
  if (pid < 0) {
    (void)::close(to[1]);
    (void)::close(from[0]);
    errno = fork_error;
    return system_error("cannot start chromium");
  }
  return std::unique_ptr<Browser>(new Browser(io, pid, to[1], from[0], std::move(profile)));
}

Browser::Browser(boost::asio::io_context* io, pid_t pid, int to, int from, std::string profile)
    : pid_(pid), profile_(std::move(profile)), to_(*io, to), from_(*io, from) {
  read();
}

Browser::~Browser() {
  (void)kill(-pid_, SIGKILL);  // with the processes of its pages
  (void)kill(pid_, SIGKILL);
  (void)waitpid(pid_, nullptr, 0);
  std::error_code ignored;
  std::filesystem::remove_all(profile_, ignored);
}

void Browser::call(const std::string& method, const Json& parameters, const std::string& session,
                   Reply reply) {
  Json json = {{"id", next_id_}, {"method", method}, {"params", parameters}};
  if (!session.empty()) json["sessionId"] = session;
  replies_[next_id_++] = std::move(reply);
  std::string text = json.dump();
  text.push_back('\0');
  waiting_.push_back(std::move(text));
  write();
}

void Browser::write() {
  if (writing_ || waiting_.empty()) return;
  writing_ = true;
  boost::asio::async_write(to_, boost::asio::buffer(waiting_.front()),
                           [this](const boost::system::error_code& error, std::size_t /*n*/) {
                             if (error == boost::asio::error::operation_aborted) return;
                             writing_ = false;
                             waiting_.pop_front();
                             if (error) return fail("chromium has ended");
                             write();
                           });
}

void Browser::read() {
  boost::asio::async_read_until(
      from_, input_, '\0', [this](const boost::system::error_code& error, std::size_t n) {
        if (error == boost::asio::error::operation_aborted) return;
        if (error) return fail("chromium has ended");
        const auto* begin = static_cast<const char*>(input_.data().data());
        const std::string text(begin, n - 1);
        input_.consume(n);
        take(text);
        read();
      });
}

void Browser::take(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("id")) return;  // an event
  const auto at = replies_.find(json["id"].get<int>());
  if (at == replies_.end()) return;
  const Reply reply = std::move(at->second);
  replies_.erase(at);
  if (json.contains("error")) {
    reply(Error{"chromium: " + json["error"].value("message", std::string("unknown error"))});
  } else {
    reply(json.value("result", Json::object()));
  }
}

void Browser::fail(const std::string& reason) {
  const std::map<int, Reply> replies = std::exchange(replies_, {});
  for (const auto& [id, reply] : replies) reply(Error{reason});
}

}  // namespace rcs::view
