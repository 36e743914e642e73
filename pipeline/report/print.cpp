#include "pipeline/report/print.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "pipeline/files/disk.h"
#include "preprocess/base.h"

extern char** environ;

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr std::array kBrowsers = {"chromium", "chromium-browser", "google-chrome",
                                  "google-chrome-stable"};
constexpr std::chrono::seconds kLongest(60);
constexpr std::chrono::milliseconds kBetweenLooks(50);

bool is_program(const fs::path& file) {
  return fs::is_regular_file(file) && ::access(file.c_str(), X_OK) == 0;
}

/// A folder that is removed with all in it at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "wireplan-print-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) {
      throw Error(fs::temp_directory_path().string() +
                  ": no folder can be made here, expected one for the browser's files; set TMPDIR "
                  "to a folder that can be written");
    }
    path_ = pattern;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// file:///... with all but plain characters escaped.
std::string address_of(const fs::path& file) {
  static constexpr const char* kHex = "0123456789ABCDEF";
  std::string address = "file://";
  for (const char c : fs::absolute(file).lexically_normal().string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '-' || c == '_' || c == '.') {
      address += c;
    } else {
      address += {'%', kHex[byte >> 4U], kHex[byte & 15U]};
    }
  }
  return address;
}

/// Waits for the process, and ends it where it takes too long. Whether it ended well by itself.
bool wait_for(pid_t process) {
  const auto end = std::chrono::steady_clock::now() + kLongest;
  int status = 0;
  for (;;) {
    const pid_t ended = ::waitpid(process, &status, WNOHANG);
    if (ended == process) return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (ended < 0 && errno != EINTR) return false;
    if (std::chrono::steady_clock::now() > end) break;
    std::this_thread::sleep_for(kBetweenLooks);
  }
  ::kill(process, SIGKILL);
  ::waitpid(process, &status, 0);
  return false;
}

/// Runs a program without a shell and without what it says.
bool run_silently(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t process = 0;
  const int failed =
      ::posix_spawn(&process, arguments.front(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  return failed == 0 && wait_for(process);
}

std::vector<std::string> browser_words(const fs::path& browser, const fs::path& page,
                                       const fs::path& pdf, const fs::path& profile) {
  std::vector<std::string> words = {browser.string(),
                                    "--headless",
                                    "--no-first-run",
                                    "--no-default-browser-check",
                                    "--disable-extensions",
                                    "--disable-background-networking",
                                    "--disable-sync",
                                    "--disable-gpu",
                                    "--disable-3d-apis",  // the sheet draws without
                                    "--disable-dev-shm-usage",
                                    "--no-pdf-header-footer",
                                    "--user-data-dir=" + profile.string(),
                                    "--print-to-pdf=" + pdf.string()};
  if (::geteuid() == 0) words.push_back("--no-sandbox");  // which root cannot have
  words.push_back(address_of(page));
  return words;
}

}  // namespace

fs::path find_browser() {
  if (const char* named = std::getenv("WIREPLAN_CHROMIUM"); named != nullptr && *named != 0) {
    if (is_program(named)) return named;
    throw Error("WIREPLAN_CHROMIUM: " + std::string(named) +
                " is no program, expected the path of Chromium or Chrome");
  }
  const char* path = std::getenv("PATH");
  for (const char* name : kBrowsers) {
    std::istringstream folders(path == nullptr ? "/usr/bin:/bin" : path);
    for (std::string folder; std::getline(folders, folder, ':');) {
      if (!folder.empty() && is_program(fs::path(folder) / name)) return fs::path(folder) / name;
    }
  }
  throw Error(
      "render: no Chromium or Chrome on the PATH, expected one to print the sheet with; install "
      "the package chromium, set WIREPLAN_CHROMIUM to its path, or print report.html from any "
      "browser");
}

fs::path print_sheet(const fs::path& report, const fs::path& folder) {
  const fs::path page = report.parent_path() / "report.html";
  if (!fs::is_regular_file(page)) {
    throw Error(page.string() +
                ": is not there, expected the page beside its report; run the case again with a "
                "wireplan that makes pages (built with the packages nodejs and npm)");
  }
  if (read_if_there(page).find("sheet-title") == std::string::npos) {
    throw Error(page.string() +
                ": has no sheet to print, an earlier wireplan made it; run the case again");
  }
  const fs::path browser = find_browser();
  const TemporaryFolder own;
  const fs::path pdf = own.path() / "sheet.pdf";
  const bool done = run_silently(browser_words(browser, page, pdf, own.path() / "profile"));
  const std::string bytes = read_if_there(pdf);
  if (!done || !bytes.starts_with("%PDF")) {
    throw Error(browser.string() + ": printed no PDF of " + page.string() +
                " within a minute, expected a Chromium that runs without a display; name another "
                "by WIREPLAN_CHROMIUM, or print the page from any browser");
  }
  fs::create_directories(folder);
  write_whole(bytes, folder / "sheet.pdf");
  return folder / "sheet.pdf";
}

}  // namespace wireplan::pipeline
