// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <numeric>
#include <thread>

#include "hexmesh/core/interruption.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/lattice_reader.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/element_tree.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/plain_hdf5.h"

namespace test_files {

using namespace hexmesh;
using namespace testing_support;
namespace fs = std::filesystem;

/// Change one attribute of a file with the HDF5 library itself.
void set_version(const fs::path& path, int version) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t attribute = H5Aopen(file, "version", H5P_DEFAULT);
  H5Awrite(attribute, H5T_NATIVE_INT, &version);
  H5Aclose(attribute);
  H5Fclose(file);
}

Lattice small_lattice() {
  Lattice lattice = bitten_ball({0.8, 0.8, 2.5}, {1, 0, 0}, random_rotation(4));
  lattice.segments[1].segment.name = "Größe ü";
  lattice.surface.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  lattice.surface.triangles = {{0, 1, 2}};
  lattice.surface.segment = {2};
  lattice.history = {"hexscan a", "hexmesh build 'b c'"};
  return lattice;
}

/// Whose points move with its cells.
Lattice lattice_with_surface() {
  Lattice lattice = small_lattice();
  for (std::size_t p = 0; p < 3; ++p) lattice.surface.points[p] = lattice.voxels.center(lattice.levels[0].cells[p]);
  return lattice;
}

TEST(LatticeReader, PiecesAreTheWholeAndKnowWhatIsAroundThem) {
  const TemporaryFolder folder;
  for (const Lattice& lattice : {small_lattice(), grey_ball({1, 1.2, 2}, {0, 1, 1})}) {
    write_lattice(lattice, folder / "a");
    const LatticeReader reader(folder / "a");
    const Lattice outline = reader.outline();
    EXPECT_TRUE(outline.labels.empty());
    EXPECT_EQ(outline.segments.size(), lattice.segments.size());
    for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n) {
      const Level& level = lattice.levels[n];
      const std::vector<Element> elements = form_elements(lattice, n);
      ASSERT_EQ(reader.num_cells(n), level.cells.size());
      // Counted in two shares, as two processes would.
      const std::size_t half = level.cells.size() / 2;
      std::vector<std::uint64_t> rows = reader.cells_in_layers(n, 0, half),
                                 more = reader.cells_in_layers(n, half, level.cells.size() - half);
      const auto layers = static_cast<std::int32_t>(rows.size());
      for (std::size_t k = 0; k < rows.size(); ++k) rows[k] += more[k];
      std::exclusive_scan(rows.begin(), rows.end(), rows.begin(), std::uint64_t{0});
      rows.push_back(level.cells.size());
      std::size_t next = 0;
      for (std::int32_t begin = 0; begin < layers; begin += 2) {
        LatticePiece piece = reader.read_layers(outline, n, rows, begin, std::min(begin + 2, layers), 1);
        Level& part = piece.lattice.levels[n];
        reader.read_elements(piece.lattice, n, part.element);
        const std::vector<Element> own = form_elements(piece.lattice, n);
        EXPECT_LE(own.size(), std::max(part.cells.size(), lattice.materials.size()));
        EXPECT_EQ(piece.first_row, next);
        next += piece.num_own_cells;
        for (std::size_t c = 0; c < part.cells.size(); ++c) {
          const std::size_t w = piece.first_row - piece.first_cell + c;
          const Index3 whole = {part.cells[c][0], part.cells[c][1], part.cells[c][2] + piece.low};
          ASSERT_EQ(whole, level.cells[w]);
          EXPECT_EQ(part.segment[c], level.segment[w]);
          EXPECT_EQ(part.parts[c], level.parts[w]);
          EXPECT_EQ(part.fill(c), level.fill(w));
          const Element &a = own[part.element[c]], &b = elements[level.element[w]];
          EXPECT_EQ(a.shear, b.shear);
          EXPECT_EQ(a.bulk, b.bulk);
          const Vec3 corner = lattice.corner() + lattice.cell_edges(n) * Vec3(whole[0], whole[1], whole[2]);
          EXPECT_LT((piece.lattice.corner() +
                     piece.lattice.cell_edges(n) * Vec3(part.cells[c][0], part.cells[c][1], part.cells[c][2]) - corner)
                        .norm(),
                    1e-9);
        }
        const Grid& voxels = piece.lattice.voxels;
        for (std::size_t v = 0; v < piece.lattice.labels.size(); ++v) {
          Index3 index = voxels.index(v);
          index[2] += piece.low * level.voxels_per_cell[2];
          ASSERT_EQ(piece.lattice.labels[v], lattice.labels[lattice.voxels.offset(index)]);
        }
      }
      EXPECT_EQ(next, level.cells.size());
    }
  }
}

TEST(LatticeFile, ReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  const Lattice lattice = small_lattice();
  write_lattice(lattice, folder / "a");
  const Lattice back = read_lattice(folder / "a");
  EXPECT_TRUE(same_grid(back.voxels, lattice.voxels, 1e-12));
  EXPECT_EQ(back.labels, lattice.labels);
  EXPECT_EQ(back.history, lattice.history);
  EXPECT_EQ(back.segments[1].segment.name, "Größe ü");
  EXPECT_EQ(back.segments[1].material->young, lattice.segments[1].material->young);
  EXPECT_EQ(back.surface.triangles, lattice.surface.triangles);
  ASSERT_EQ(back.levels.size(), lattice.levels.size());
  for (std::size_t l = 0; l < lattice.levels.size(); ++l) {
    EXPECT_EQ(back.levels[l].cells, lattice.levels[l].cells);
    EXPECT_EQ(back.levels[l].element, lattice.levels[l].element);
    EXPECT_EQ(back.levels[l].segment, lattice.levels[l].segment);
    EXPECT_EQ(back.levels[l].merge, lattice.levels[l].merge);
    EXPECT_EQ(back.levels[l].parts, lattice.levels[l].parts);
    EXPECT_EQ(back.levels[l].children, lattice.levels[l].children);
    EXPECT_EQ(back.levels[l].filled, lattice.levels[l].filled);
    EXPECT_EQ(form_elements(back, static_cast<int>(l)).back().bulk,
              form_elements(lattice, static_cast<int>(l)).back().bulk);
  }
}

TEST(LatticeFile, ReadsOnlyTheLevelsAskedFor) {
  const TemporaryFolder folder;
  write_lattice(small_lattice(), folder / "a");
  const Lattice lattice = read_lattice(folder / "a", {2});
  EXPECT_EQ(cells_of_levels(folder / "a").size(), 4U);
  EXPECT_TRUE(lattice.levels[0].cells.empty());
  EXPECT_FALSE(lattice.levels[2].cells.empty());
  EXPECT_EQ(lattice.levels[0].voxels_per_cell, (Index3{1, 1, 1}));
  EXPECT_EQ(form_elements(lattice, 2)[0].shear, form_elements(small_lattice(), 2)[0].shear);
}

TEST(LatticeFile, WithoutVoxelsHasTheSameFaces) {
  const TemporaryFolder folder;
  const Lattice lattice = small_lattice();
  write_lattice(lattice, folder / "a");
  const Lattice back = read_lattice(folder / "a", {1}, Elements::stored, Voxels::left_out);
  EXPECT_TRUE(back.labels.empty());
  EXPECT_TRUE(back.surface.points.empty());
  EXPECT_GT(exposed_faces(back).size(), 100U);
  EXPECT_EQ(exposed_faces(back), exposed_faces(lattice));
}

TEST(LatticeFile, RefusesFacesThatAreNotOfTheirBlock) {
  const TemporaryFolder folder;
  write_lattice(small_lattice(), folder / "a");
  add_to_dataset(folder / "a", "/faces/face", 0, 1000);
  {
    const Lattice lattice = read_lattice(folder / "a", {1}, Elements::stored, Voxels::left_out);
    EXPECT_NE(message_of(ErrorKind::input, [&] { exposed_faces(lattice); }).find("'/faces/face'"), std::string::npos);
  }
  add_to_dataset(folder / "a", "/faces/block", 3, 1000);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_lattice(folder / "a"); }).find("'/faces/block' beyond the voxels"),
            std::string::npos);
}

TEST(LatticeFile, ItsChecksumIsThatOfItsContent) {
  const TemporaryFolder folder;
  Lattice lattice = small_lattice();
  write_lattice(lattice, folder / "a");
  write_lattice(lattice, folder / "b");
  EXPECT_EQ(content_checksum(folder / "a").size(), 64U);
  EXPECT_EQ(content_checksum(folder / "a"), content_checksum(folder / "b"));
  write_lattice(lattice, folder / "c", MatrixStorage::none);
  EXPECT_NE(content_checksum(folder / "a"), content_checksum(folder / "c"));
  lattice.materials[0].material.young *= 1 + 1e-15;
  write_lattice(lattice, folder / "d");
  EXPECT_NE(content_checksum(folder / "a"), content_checksum(folder / "d"));
}

TEST(LatticeFile, TheSameContentIsTheSameBytes) {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name) {
    write_lattice(small_lattice(), folder / ("lattice" + name));
    Result r = rest_state(small_lattice(), 1);
    r.displacement.assign(r.nodes.size(), Vec3(1, 2, 3));
    r.report = "{}";
    write_result(r, folder / ("result" + name), folder / ("lattice" + name));
  };
  write("1");
  sleep(1);  // what HDF5 notes of times is in seconds
  write("2");
  EXPECT_EQ(read_text(folder / "lattice1"), read_text(folder / "lattice2"));
  EXPECT_EQ(read_text(folder / "result1"), read_text(folder / "result2"));
}

TEST(LatticeFile, SaysWhetherItsContentWasChanged) {
  const TemporaryFolder folder;
  for (const MatrixStorage storage : {MatrixStorage::none, MatrixStorage::all}) {
    write_lattice(small_lattice(), folder / "a", storage);
    EXPECT_TRUE(is_as_written(folder / "a"));
    scale_dataset(folder / "a", "/segments/color", 0.5);
    EXPECT_FALSE(is_as_written(folder / "a"));
  }
}

TEST(LatticeFile, WhatCannotBeUtf8IsReplacedWhereItIsWritten) {
  const TemporaryFolder folder;
  Lattice lattice = small_lattice();
  lattice.segments[1].segment.name =
      "Gr\xf6\xdf"
      "e \xc3\xbc \xed\xa0\x80";
  write_lattice(lattice, folder / "a");
  EXPECT_EQ(read_lattice(folder / "a").segments[1].segment.name, "Gr\uFFFD\uFFFDe ü \uFFFD\uFFFD\uFFFD");
}

TEST(LatticeFile, VersionsAreThoseOfTheSpecification) {
  const std::string formats = read_text(HEXTOOLS_SOURCE "/libhexmesh/FORMATS.md");
  EXPECT_NE(formats.find(fmt::format("now {} for lattices and {} for results; {} for lattices whose cells are split",
                                     lattice_version, result_version, split_lattice_version)),
            std::string::npos);
}

TEST(LatticeFile, RefusesNewerOtherAndMissingFilesByName) {
  const TemporaryFolder folder;
  write_lattice(small_lattice(), folder / "a");
  set_version(folder / "a", split_lattice_version + 1);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_lattice(folder / "a"); })
                .find(fmt::format("has version {}, expected {}: it was made by a newer tool", split_lattice_version + 1,
                                  lattice_version)),
            std::string::npos);
  set_version(folder / "a", lattice_version - 1);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_lattice(folder / "a"); }).find("an older tool, make it again"),
            std::string::npos);
  write_text(folder / "b", "not HDF5");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_lattice(folder / "b"); }).find(folder.path("b")),
            std::string::npos);
}

TEST(ResultFile, ReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  const Lattice lattice = box({2, 1, 1}, {1, 1, 1});
  Result r{lattice.voxels, lattice.labels, lattice.segments};
  r.cells = lattice.levels[0].cells;
  r.cell_nodes = {{0, 1, 3, 4, 6, 7, 9, 10}, {1, 2, 4, 5, 7, 8, 10, 11}};
  r.nodes = rest_state(lattice, 0).nodes;
  r.displacement.assign(12, Vec3(-1, 0.5, 0.25));
  r.segment = {1, 1};
  r.cell_fields["fill"] = {1, 0.5};
  r.conditions = {{"held", {{1, 2, 3}}, {{0, 0, 0}}, {true, false, true}}};
  r.report = "{}";
  write_result(r, folder / "a");
  const Result back = read_result(folder / "a");
  EXPECT_EQ(back.displacement, r.displacement);
  EXPECT_EQ(back.cell_nodes, r.cell_nodes);
  EXPECT_EQ(back.cell_fields, r.cell_fields);
  EXPECT_EQ(back.conditions[0].name, "held");
  EXPECT_EQ(back.conditions[0].axes, (std::array{true, false, true}));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_lattice(folder / "a"); })
                .find("is a 'hexmesh result' file, expected a 'hexmesh lattice'"),
            std::string::npos);
}

TEST(ResultFile, TakesVoxelsAndSurfaceOfItsLatticeFile) {
  const TemporaryFolder folder;
  Lattice lattice = lattice_with_surface();
  for (const bool of_voxels : {false, true}) {
    lattice.surface_of_voxels = of_voxels;
    write_lattice(lattice, folder / "lattice");
    Result r = rest_state(read_lattice(folder / "lattice", {1}, Elements::stored, Voxels::left_out), 1);
    EXPECT_TRUE(r.labels.empty());
    r.displacement.assign(r.nodes.size(), Vec3(1, 2, 3));
    r.report = "{}";
    write_result(r, folder / "result", folder / "lattice");
    const Result back = read_result(folder / "result");
    EXPECT_EQ(back.labels, lattice.labels);
    EXPECT_EQ(back.surface_of_voxels, of_voxels);
    EXPECT_EQ(back.surface.triangles.size(), of_voxels ? 0U : 1U);
    // Surfaces move with the cells.
    for (const Vec3& u : back.surface_displacement) EXPECT_LT((u - Vec3(1, 2, 3)).norm(), 1e-12);
    EXPECT_EQ(back.surface_displacement.size(), of_voxels ? 0U : 3U);
  }
}

TEST(ResultFile, IsTheSameWithVoxelsOfItsOwn) {
  const TemporaryFolder folder;
  Lattice lattice = lattice_with_surface();
  for (const bool of_voxels : {false, true}) {
    lattice.surface_of_voxels = of_voxels;
    write_lattice(lattice, folder / "lattice");
    Result r = rest_state(lattice, 1);
    r.displacement.assign(r.nodes.size(), Vec3(1, 2, 3));
    r.report = "{}";
    write_result(r, folder / "by_lattice", folder / "lattice");
    write_result(r, folder / "own");
    EXPECT_EQ(read_text(folder / "own"), read_text(folder / "by_lattice"));
  }
}

TEST(Files, AreReadAndWrittenBySeveralThreads) {
  const TemporaryFolder folder;
  const Lattice lattice = small_lattice();
  write_lattice(lattice, folder / "a");
  const std::string expected = read_text(folder / "a");
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int n = 0; n < 10; ++n) {
        const Lattice read = read_lattice(folder / "a");
        const fs::path own = folder / fmt::format("{}", t);
        OutputFile file(own, "", true);
        write_lattice(read, file.path());
        file.commit();
        wrong += read_text(own) != expected || read.faces->all() != lattice.faces->all();
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(Interruptible, EndsTheMakingOfALattice) {
  struct Enough {};
  int asked = 0;
  const auto make = [] { return box({4, 4, 4}, {1, 1, 1}).num_levels(); };
  {
    const Interruptible outer([&] { ++asked; });
    EXPECT_EQ(make(), 3);
    EXPECT_GT(asked, 0);
    {
      const Interruptible inner([] { throw Enough(); });
      EXPECT_THROW(make(), Enough);
    }
    const int before = asked;
    EXPECT_EQ(make(), 3);
    EXPECT_GT(asked, before);
  }
  asked = 0;
  EXPECT_EQ(make(), 3);
  EXPECT_EQ(asked, 0);
}

TEST(ResultFile, KeepsTheStepsOfAMotion) {
  const TemporaryFolder folder;
  Result r = rest_state(box({2, 1, 1}, {1, 1, 1}), 0);
  r.displacement.assign(12, Vec3(3, 3, 3));
  r.velocity.assign(12, Vec3(-1, 0, 0));
  r.report = "{}";
  ResultWriter writer(folder / "a");
  for (int n = 0; n < 3; ++n) {
    const std::vector<double> density(2, 0.5 * n);
    writer.add_step(0.25 * n, {std::vector<Vec3>(12, Vec3::Constant(n)),
                               std::vector<Vec3>(12, Vec3::Constant(10 + n)),
                               std::vector<Vec3>(12, Vec3::Constant(20 + n)),
                               {{"fill", density}}});
  }
  writer.finish(r);
  const Result back = read_result(folder / "a");
  EXPECT_EQ(back.velocity, r.velocity);
  EXPECT_EQ(back.times, (std::vector<double>{0, 0.25, 0.5}));
  const MotionStep step = read_step(folder / "a", back, 2);
  EXPECT_EQ(step.displacement, std::vector<Vec3>(12, Vec3(2, 2, 2)));
  EXPECT_EQ(step.velocity, std::vector<Vec3>(12, Vec3(12, 12, 12)));
  EXPECT_EQ(step.contact_force, std::vector<Vec3>(12, Vec3(22, 22, 22)));
  EXPECT_EQ(step.cell_fields.at("fill"), std::vector<double>(2, 1));
}

TEST(OutputFile, AppearsOnlyWhenCommitted) {
  const TemporaryFolder folder;
  {
    OutputFile file(folder.path("a"));
    std::ofstream(file.path()) << "half";
  }
  EXPECT_TRUE(fs::is_empty(folder / ""));
  OutputFile file(folder.path("a"));
  std::ofstream(file.path()) << "whole";
  file.commit();
  EXPECT_EQ(read_text(folder / "a"), "whole");
}

TEST(OutputFile, ReplacesNothingUnlessAsked) {
  const TemporaryFolder folder;
  write_text(folder / "a", "precious");
  EXPECT_NE(message_of(ErrorKind::output, [&] { OutputFile(folder.path("a")); }).find("exists"), std::string::npos);
  EXPECT_EQ(read_text(folder / "a"), "precious");
  OutputFile(folder.path("a"), "", true).commit();
  EXPECT_EQ(read_text(folder / "a"), "");
}

}  // namespace test_files
