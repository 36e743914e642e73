// Work in a process of its own: what it sends arrives, what it throws is thrown here, and however
// it ends, this process goes on.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "preprocess/base.h"
#include "preprocess/volume/apart.h"
#include "tests/messages.h"

namespace wireplan::preprocess {
namespace {

constexpr const char* kEnded = "it ended";

// The numbers 0 to count - 1, sent from there.
std::vector<int> numbers_from_apart(std::size_t count) {
  std::vector<int> numbers(count);
  run_apart(
      [&](const Send& send, const At&) {
        std::vector<int> sent(count);
        std::iota(sent.begin(), sent.end(), 0);
        send(sent.data(), sent.size() * sizeof(int));
      },
      [&](const Receive& receive) { receive(numbers.data(), numbers.size() * sizeof(int)); },
      kEnded);
  return numbers;
}

// What is told where the work, at "a file", does this before it has sent all.
template <typename Work>
std::string message_where(Work work) {
  return message_of([&] {
    run_apart(
        [&](const Send& send, const At& at) {
          at("a file");
          const int sent = 1;
          send(&sent, sizeof sent);
          work();
        },
        [](const Receive& receive) {
          for (int k = 0, received = 0; k < 2; ++k) receive(&received, sizeof received);
        },
        kEnded);
  });
}

TEST(RunApart, AllThatIsSentArrivesInItsOrder) {
  std::vector<int> expected(3000000);  // far more than a pipe holds
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(numbers_from_apart(expected.size()), expected);
  EXPECT_EQ(numbers_from_apart(1), std::vector<int>{0});
}

TEST(RunApart, AnErrorOfTheWorkIsThrownHere) {
  EXPECT_EQ(message_where([] { throw Error("x: is damaged"); }), "x: is damaged");
}

TEST(RunApart, HoweverTheWorkEndsItsPlaceIsTold) {
  const std::string expected = "a file: it ended";
  EXPECT_EQ(message_where([] { std::abort(); }), expected);
  EXPECT_EQ(message_where([] { ::raise(SIGSEGV); }), expected);
  EXPECT_EQ(message_where([] { ::raise(SIGKILL); }), expected);
  EXPECT_EQ(message_where([] { ::_exit(17); }), expected);
  EXPECT_EQ(message_where([] { throw std::runtime_error("a patient's name"); }), expected);
}

TEST(RunApart, WorkThatStandsStillIsGivenUp) {
  EXPECT_EQ(message_of([] {
              run_apart(
                  [](const Send&, const At& at) {
                    at("a file");
                    while (true) ::pause();
                  },
                  [](const Receive& receive) {
                    int received = 0;
                    receive(&received, sizeof received);
                  },
                  kEnded, 1);
            }),
            "a file: it ended");
}

TEST(RunApart, WhatTheWorkPrintsIsDropped) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  message_where([] {
    std::cout << "a patient's name" << std::endl;
    std::cerr << "a patient's name" << std::endl;
    std::abort();
  });
  EXPECT_EQ(testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr(), "");
}

TEST(RunApart, WhatALibraryPrintedLastCanBeTold) {
  EXPECT_EQ(message_where([] {
              std::cerr << "a patient's name" << std::endl;
              const LastWords words;
              const std::string none = words.text();
              std::fprintf(stderr, "[INFO] start\n\x1b[ERROR] tile\n \n");
              throw Error("refused" + none + words.text());
            }),
            "refused (\"[ERROR] tile\")");
  EXPECT_EQ(LastWords().text(), "");
}

TEST(RunApart, WhereNothingMoreIsWantedTheWorkIsLetGoOf) {
  const std::string message = message_of([&] {
    run_apart(
        [](const Send& send, const At&) {
          for (const int sent = 1;;) send(&sent, sizeof sent);
        },
        [](const Receive&) { throw Error("enough"); }, kEnded);
  });
  EXPECT_EQ(message, "enough");
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);  // no child is left
}

}  // namespace
}  // namespace wireplan::preprocess
