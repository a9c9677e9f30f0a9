// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "hexmesh/core/printable.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/temporary_file.h"
#include "hexmesh/file/text_file.h"
#include "support/files.h"

namespace test_atomic_file {

using namespace hexmesh;
using namespace testing_support;
namespace fs = std::filesystem;

void fill(const OutputFile& file, const std::string& text) { write_text(file.path(), text); }

std::size_t count_files(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// What a process that ends without a word leaves in a folder: the name of its temporary file.
fs::path left_by_killed_process(const fs::path& folder) {
  std::array<int, 2> channel{};
  EXPECT_EQ(pipe(channel.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const TemporaryFile file(folder, ".x", "a file");
    const std::string name = file.path().string();
    if (write(channel[1], name.data(), name.size()) < 0) _exit(1);
    raise(SIGKILL);
  }
  close(channel[1]);
  std::string name(4096, '\0');
  const ssize_t got = read(channel[0], name.data(), name.size());
  close(channel[0]);
  name.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  return name;
}

TEST(OutputFile, OfTwoRunsThatWantANameOneGetsIt) {
  const TemporaryFolder folder;
  OutputFile first(folder.path("a")), second(folder.path("a"));
  fill(first, "first");
  fill(second, "second");
  second.commit();
  EXPECT_NE(message_of(ErrorKind::output, [&] { first.commit(); }).find("exists, expected a new name"),
            std::string::npos);
  EXPECT_EQ(read_text(folder / "a"), "second");
}

TEST(RenameExclusively, EveryWayLeavesANameThatIsTaken) {
  for (const auto way : {rename_exclusively, rename_by_no_replace, rename_by_link, rename_by_reservation}) {
    const TemporaryFolder folder;
    write_text(folder / "new", "new");
    write_text(folder / "old", "old");
    EXPECT_FALSE(way(folder / "new", folder / "old"));
    EXPECT_EQ(errno, EEXIST);
    EXPECT_EQ(read_text(folder / "old"), "old");
    EXPECT_TRUE(way(folder / "new", folder / "free"));
    EXPECT_EQ(read_text(folder / "free"), "new");
    EXPECT_FALSE(fs::exists(folder / "new"));
    EXPECT_FALSE(way(folder / "absent", folder / "nowhere"));
    EXPECT_FALSE(fs::exists(folder / "nowhere"));
  }
}

TEST(OutputFile, FollowsLinks) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "there");
  write_text(folder / "there/a", "old");
  fs::create_symlink("there/a", folder / "link");
  fs::create_symlink("there/b", folder / "to_nothing");
  for (const char* name : {"link", "to_nothing"}) {
    OutputFile file(folder.path(name), "", true);
    EXPECT_EQ(file.path().parent_path(), folder / "there");
    fill(file, "new");
    file.commit();
    EXPECT_TRUE(fs::is_symlink(folder / name));
    EXPECT_EQ(read_text(folder / name), "new");
  }
  EXPECT_EQ(read_text(folder / "there/b"), "new");
  EXPECT_THROW(OutputFile(folder.path("link")), Error) << "exists";
  fs::create_symlink("loop", folder / "loop");
  EXPECT_NE(message_of(ErrorKind::output, [&] { OutputFile(folder.path("loop"), "", true); }).find("symbolic links"),
            std::string::npos);
}

TEST(OutputFile, KeepsWhoMayReadWhatItReplaces) {
  const TemporaryFolder folder;
  write_text(folder / "a", "secret");
  fs::permissions(folder / "a", fs::perms::owner_read | fs::perms::owner_write);
  OutputFile file(folder.path("a"), "", true);
  file.commit();
  EXPECT_EQ(fs::status(folder / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST(OutputFile, DevicesAndPipesGetTheBytes) {
  const TemporaryFolder folder;
  {
    OutputFile file("/dev/null");
    fill(file, "gone");
    file.commit();
  }
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = read_text(folder / "pipe"); });
  OutputFile file(folder.path("pipe"));
  EXPECT_TRUE(file.is_stream());
  fill(file, "through");
  file.commit();
  reader.join();
  EXPECT_EQ(got, "through");
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  EXPECT_EQ(count_files(folder / ""), 1U);
  OutputFile full("/dev/full");
  fill(full, "too much");
  EXPECT_NE(message_of(ErrorKind::output, [&] { full.commit(); }).find("No space left"), std::string::npos);
}

TEST(OutputFile, SaysAtOnceWhatCannotBeWritten) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "sub");
  write_text(folder / "a", "");
  for (const auto& [name, word] : {std::pair<std::string, const char*>{folder.path("sub"), "is a folder"},
                                   {folder.path("a/b"), "Not a directory"},
                                   {folder.path("absent/b"), "No such file"},
                                   {folder.path(std::string(300, 'n')), "too long"},
                                   {"", "expected the name of a file"}})
    EXPECT_NE(message_of(ErrorKind::output, [&, &n = name] { OutputFile(n, "", true); }).find(word), std::string::npos)
        << name;
}

TEST(InputFile, APipeCanBeReadAgain) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.path("pipe.toml").c_str(), 0600), 0);
  std::thread writer([&] { write_text(folder / "pipe.toml", "words"); });
  const InputFile file(folder.path("pipe.toml"));
  writer.join();
  EXPECT_EQ(read_text(file.path()), "words");
  EXPECT_EQ(read_text(file.path()), "words");
  EXPECT_EQ(file.path().extension(), ".toml");
  EXPECT_EQ(file.folder(), "") << "names in it are relative to the working directory";
  EXPECT_EQ(with_known_names("'" + file.path().string() + "' is wrong"), "'" + folder.path("pipe.toml") + "' is wrong");
}

TEST(InputFile, SaysWhatIsNoFile) {
  const TemporaryFolder folder;
  fs::create_symlink("loop", folder / "loop");
  write_text(folder / "large", std::string(100, 'x'));
  const auto message = [&](const std::string& name, std::uintmax_t most = InputFile::any_size) {
    return message_of(ErrorKind::input, [&] { InputFile(name, most); });
  };
  EXPECT_NE(message(folder.path("absent")).find("no such file"), std::string::npos);
  EXPECT_NE(message(folder.path("loop")).find("symbolic links"), std::string::npos);
  EXPECT_NE(message(folder.path(std::string(300, 'n'))).find("too long"), std::string::npos);
  EXPECT_NE(message("/dev/zero").find("is a device"), std::string::npos);
  EXPECT_NE(message("/dev/null").find("is empty"), std::string::npos);
  EXPECT_NE(message(folder.path(""), 1000).find("is a folder"), std::string::npos);
  EXPECT_NE(message(folder.path("large"), 99).find("has more than"), std::string::npos);
  EXPECT_EQ(InputFile(folder.path("large"), 100).path(), folder / "large");
}

TEST(InputFile, AStreamWithoutAnEndIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  std::signal(SIGPIPE, SIG_IGN);
  std::thread writer([&] {
    std::ofstream out(folder / "pipe");
    while (out << std::string(1 << 16, 'y')) {
    }
  });
  EXPECT_NE(message_of(ErrorKind::input, [&] { InputFile(folder.path("pipe"), 1 << 20); }).find("has more than 1 MB"),
            std::string::npos);
  writer.join();
}

TEST(InputFile, WithoutAPlaceToSpoolItIsAnErrorOfOutput) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  const std::string before = temporary_place().string();
  setenv("TMPDIR", folder.path("absent").c_str(), 1);
  std::signal(SIGPIPE, SIG_IGN);
  std::thread writer([&] { write_text(folder / "pipe", "words"); });
  const std::string message = message_of(ErrorKind::output, [&] { InputFile(folder.path("pipe")); });
  setenv("TMPDIR", before.c_str(), 1);
  writer.join();
  EXPECT_NE(message.find("cannot spool"), std::string::npos) << message;
  EXPECT_NE(message.find("TMPDIR"), std::string::npos) << message;
}

TEST(TemporaryFile, WhatAKilledProcessLeftIsClearedByTheNext) {
  const TemporaryFolder folder;
  const fs::path left = left_by_killed_process(folder / "");
  ASSERT_TRUE(fs::exists(left)) << left;
  // Of a process that lives, of another boot, of an older version, and of the user.
  const std::string name = left.filename().string();
  const std::size_t owner = name.find('-') + 1, process = name.find('-', owner) + 1,
                    start = name.find('-', process) + 1;
  const std::string of_another_boot = ".hextools-00000000-" + name.substr(process);
  const TemporaryFile own(fs::temp_directory_path(), "", "mine");
  const std::string alive = own.path().filename().string() + "copy";
  const std::string reused = name.substr(0, process) + fmt::format("{}-1-AbCdEf", getpid());
  for (const std::string& other :
       {of_another_boot, alive, reused, std::string(".hextools-AbCdEf"), std::string("mine")})
    write_text(folder / other, "");
  fs::create_directories(folder / (name.substr(0, start) + "1-FoLdEr"));
  write_text(folder / (name.substr(0, start) + "1-FoLdEr") / "input.mha", "");
  { const TemporaryFile next(folder / "", "", "next"); }
  EXPECT_FALSE(fs::exists(left));
  EXPECT_FALSE(fs::exists(folder / reused)) << "its number is another process's by now";
  EXPECT_FALSE(fs::exists(folder / (name.substr(0, start) + "1-FoLdEr")));
  for (const std::string& other : {of_another_boot, alive, std::string(".hextools-AbCdEf"), std::string("mine")})
    EXPECT_TRUE(fs::exists(folder / other)) << other;
}

TEST(NewFolder, GoesAwayUnlessItIsKept) {
  const TemporaryFolder folder;
  { const NewFolder made(folder / "a/b/c"); }
  EXPECT_FALSE(fs::exists(folder / "a"));
  {
    NewFolder made(folder / "a/b/");
    made.keep();
  }
  EXPECT_TRUE(fs::is_directory(folder / "a/b"));
  { const NewFolder there(folder / "a"); }
  EXPECT_TRUE(fs::is_directory(folder / "a/b"));
  {
    const NewFolder used(folder / "a/c");
    write_text(folder / "a/c/file", "");
  }
  EXPECT_TRUE(fs::exists(folder / "a/c/file"));
  write_text(folder / "file", "");
  EXPECT_NE(message_of(ErrorKind::output, [&] { NewFolder(folder / "file/x"); }).find("Not a directory"),
            std::string::npos);
  EXPECT_THROW(NewFolder(folder / std::string(300, 'n')), Error);
}

TEST(ReadTextFile, TakesFilesOfABoundedSizeOnly) {
  const TemporaryFolder folder;
  write_text(folder / "a", "text");
  EXPECT_EQ(read_text_file(folder / "a", "a"), "text");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_text_file(folder / "a", "a", 3); }).find("'a' has more than"),
            std::string::npos);
  for (const char* name : {"/dev/zero", "/dev/null"})
    EXPECT_NE(message_of(ErrorKind::input, [&] { read_text_file(name, "b"); }).find("'b' is no file"),
              std::string::npos);
  EXPECT_THROW(read_text_file(folder / "", "c"), Error);
  EXPECT_THROW(read_text_file(folder / "absent", "c"), Error);
}

TEST(Printable, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(printable("Größe ü\n\t."), "Größe ü\n\t.");
  EXPECT_EQ(printable("\x1b[31mred\x07"), "\\x1b[31mred\\x07");
  EXPECT_EQ(printable("a\rb\x7f"), "a\\x0db\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\u009b31m")
      << "a control character of two bytes";
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "gpj"),
            "\\u202egpj")
      << "turns the direction of writing";
  EXPECT_EQ(printable("liver\xe9.nrrd"), "liver\\xe9.nrrd") << "Latin-1";
  for (const char* wrong : {"\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82", "\x80"})
    EXPECT_EQ(printable(wrong).find('\\'), 0U) << "no UTF-8";
  EXPECT_EQ(printable_line("a\nb"), "a b");
}

}  // namespace test_atomic_file
