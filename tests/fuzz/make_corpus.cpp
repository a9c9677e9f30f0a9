// SPDX-License-Identifier: Apache-2.0
// Small valid files of every format, one folder per fuzz target: make_corpus FOLDER.
#include <fmt/format.h>
#include <zlib.h>

#include <random>

#include "hexmesh/scan/image_io.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/scan_files.h"

using namespace hexmesh;
using namespace testing_support;
namespace fs = std::filesystem;

namespace {

std::string gzip(const std::string& bytes) {
  const TemporaryFolder folder;
  const std::string path = folder.path("a.gz");
  const gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  return read_text(path);
}

std::string surface(char which, const std::string& text) { return which + text; }

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const fs::path root = argv[1];
  for (const char* target :
       {"nrrd", "nifti", "meta", "vti", "dicom", "surface", "markup", "lattice", "result", "scene"})
    fs::create_directories(root / target);
  const LabelVolume volume = make_volume({8, 7, 6}, {1, 1, 2}, [](const Index3& v) { return v[0] > 4 ? 2 : v[1] / 4; });

  write_text(root / "nrrd/raw", nrrd_bytes(volume));
  write_text(root / "nrrd/ras", nrrd_bytes(volume, "right-anterior-superior"));
  write_labels(volume, root / "nrrd/slicer.nrrd");
  write_text(root / "nrrd/ascii",
             "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\n0 1 1 0 2 2 1 0\n");
  write_text(
      root / "nrrd/layers",
      "NRRD0005\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 2 2 2\nspace directions: none "
      "(1,0,0) (0,1,0) (0,0,1)\nkinds: list domain domain domain\nencoding: raw\nspace origin: (0,0,0)\n"
      "Segment0_ID:=a\nSegment0_Name:=liver\nSegment0_Layer:=0\nSegment0_LabelValue:=1\nSegment0_Color:=0.1 0.2 "
      "0.3\nSegment1_ID:=b\nSegment1_Layer:=1\nSegment1_LabelValue:=1\n\n" +
          std::string(16, '\1'));
  write_text(root / "nifti/plain", nifti_bytes(volume));
  write_text(root / "nifti/gzip", gzip(nifti_bytes(volume)));
  write_text(root / "meta/local", meta_bytes(volume));
  write_text(root / "vti/ascii", vti_bytes(volume));

  write_ct_series(volume, root / "ct");
  fs::rename(root / "ct/IM3", root / "dicom/slice");
  fs::remove_all(root / "ct");
  write_dicom_seg(volume, SegType::binary, root / "dicom/binary");
  write_dicom_seg(volume, SegType::fractional, root / "dicom/fractional");
  write_dicom_seg(volume, SegType::labelmap, root / "dicom/labelmap");
  write_rtstruct(volume.grid, {1, 1, 1}, {5, 4, 3}, root / "dicom/contours");

  write_text(root / "surface/obj",
             surface(0, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1/1 2//2 4\nl 1 2 3\n"));
  write_text(root / "surface/stl",
             surface(1,
                     "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                     "endfacet\nendsolid a\n"));
  std::string binary(84, ' ');
  binary[80] = 1;
  binary[81] = binary[82] = binary[83] = 0;
  write_text(root / "surface/stl_binary", surface(1, binary + std::string(50, '\1')));
  write_text(
      root / "surface/ply",
      surface(2,
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
              "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
  write_text(root / "surface/off", surface(3, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
  write_text(
      root / "surface/vtp",
      surface(4,
              "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\"><PolyData><Piece "
              "NumberOfPoints=\"3\" NumberOfLines=\"1\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float32\" "
              "NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points><Lines><DataArray "
              "type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1</DataArray><DataArray type=\"Int64\" "
              "Name=\"offsets\" format=\"ascii\">2</DataArray></Lines><Polys><DataArray type=\"Int64\" "
              "Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray><DataArray type=\"Int64\" Name=\"offsets\" "
              "format=\"ascii\">3</DataArray></Polys></Piece></PolyData></VTKFile>"));
  write_text(
      root / "markup/points",
      surface(0,
              R"({"markups":[{"type":"Fiducial","coordinateSystem":"RAS","controlPoints":[{"position":[1,2,3]}]}]})"));
  write_text(root / "markup/roi",
             surface(0, R"({"markups":[{"type":"ROI","coordinateSystem":"LPS","center":[1,2,3],"size":[2,4,6],)"
                        R"("objectToBase":[0,1,0,-1,0,0,0,0,1]}]})"));
  write_text(root / "markup/list", surface(1, "# CoordinateSystem = LPS\nF_0,1,2.5,-3,0\n"));
  write_text(root / "markup/brackets", surface(0, std::string(300000, '[')));

  // Changes of a good file, 12 bytes each: see lying_input.h.
  std::mt19937 random(1);
  for (int n = 0; n < 40; ++n) {
    std::string changes(12 + 12 * (n % 3), '\0');
    for (char& byte : changes) byte = static_cast<char>(random());
    write_text(root / "lattice" / std::to_string(n), changes);
    write_text(root / "result" / std::to_string(n), '\0' + changes);
  }
  write_text(root / "lattice/good", "");
  write_text(
      root / "result/report",
      R"(1{"converged":false,"load_fraction":0.5,"reason":"a","dropped_cells":3,"conditions":[{"name":"a",)"
      R"("reaction_n":[1,2,3]}],"levels":[{"level":1,"error_mm":{"mean":1}}],"motion":{"rows":[{"time_s":1}]}})");
  write_text(
      root / "scene/equilibrium",
      surface(0,
              "[solve]\nlevel = 1\nstrain = \"auto\"\naccuracy_mm = 0.1\n[material.liver]\nyoung_kpa = 3\n[[fix]]\n"
              "point_mm = [1, 2, 3]\nradius_mm = 4\n[[displace]]\nbox_mm = [0, 1, 0, 1, 0, 1]\nby_mm = [1, 0, "
              "0]\naxes = \"xy\"\n[[force]]\nhalfspace = { point_mm = [0, 0, 0], normal = [0, 0, 1e200] }\nnewton = "
              "[0, 0, 1]\n[gravity]\nm_s2 = [0, 0, -9.8]\n"));
  write_text(
      root / "scene/motion",
      surface(0,
              "[solve]\nkind = \"dynamics\"\n[dynamics]\nstep_s = 0.01\nduration_s = 1\n[[displace]]\nsegment = "
              "\"a\"\ntable = [[0, 0, 0, 0], [1, 1, 2, 3]]\n[[contact]]\nsphere = { center_mm = [0, 0, 0], radius_mm "
              "= 3 }\nstiffness_n_mm = 1\nvelocity_mm_s = [1, 0, 0]\n[damping]\nmass_per_s = 1\n"));
  write_text(root / "scene/deep", surface(
                                      0, "a" + [] {
                                        std::string key;
                                        for (int n = 0; n < 100000; ++n) key += ".a";
                                        return key;
                                      }() + " = 1\n"));
  write_text(
      root / "scene/materials",
      surface(1,
              "[material.liver]\nyoung_kpa = { offset = 1, slope = 2, min = 0.1 }\npoisson = 0.4\ndensity_kg_m3 = { "
              "points = [[0, 1], [2, 3]] }\n[material.\"*\"]\nnone = true\n"));
  return 0;
}
