#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>

#include "preprocess/files/vessel_io.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "tests/messages.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

// A folder of this test's own, removed afterwards.
class SurfaceFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / (std::string("wireplan_surface_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  fs::path folder_;
};

// ---- The formats, written by hand ------------------------------------------------------------

std::string ascii_stl(const Surface& surface) {
  std::ostringstream out;
  out.precision(9);
  out << "solid test\n";
  for (const auto& t : surface.triangles.colwise()) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (int k = 0; k < 3; ++k) {
      out << "vertex " << surface.vertices.col(t(k)).transpose() << "\n";
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid test\n";
  return out.str();
}

template <typename T>
void append_bytes(std::string& out, T value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string binary_stl(const Surface& surface) {
  std::string out(80, ' ');
  append_bytes(out, static_cast<std::uint32_t>(surface.triangles.cols()));
  for (const auto& t : surface.triangles.colwise()) {
    for (int k = 0; k < 3; ++k) append_bytes(out, 0.0f);  // the normal, which no reader needs
    for (int k = 0; k < 3; ++k) {
      for (const double x : surface.vertices.col(t(k))) append_bytes(out, static_cast<float>(x));
    }
    append_bytes(out, std::uint16_t{0});
  }
  return out;
}

std::string ascii_ply(const Surface& surface) {
  std::ostringstream out;
  out.precision(9);
  out << "ply\nformat ascii 1.0\nelement vertex " << surface.vertices.cols()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
      << surface.triangles.cols() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& p : surface.vertices.colwise()) out << p.transpose() << "\n";
  for (const auto& t : surface.triangles.colwise()) out << "3 " << t.transpose() << "\n";
  return out.str();
}

std::string binary_ply(const Surface& surface) {
  std::string out = "ply\nformat binary_big_endian 1.0\ncomment with what a scanner adds\n";
  out += "element vertex " + std::to_string(surface.vertices.cols()) +
         "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n";
  out += "element face " + std::to_string(surface.triangles.cols()) +
         "\nproperty float quality\nproperty list uchar uint vertex_index\nend_header\n";
  const auto append_big = [&](auto value) {
    std::string bytes;
    append_bytes(bytes, value);
    out.append(bytes.rbegin(), bytes.rend());
  };
  for (const auto& p : surface.vertices.colwise()) {
    for (const double x : p) append_big(x);
    append_big(std::uint8_t{200});
  }
  for (const auto& t : surface.triangles.colwise()) {
    append_big(0.5f);
    append_big(std::uint8_t{3});
    for (const int vertex : t) append_big(static_cast<std::uint32_t>(vertex));
  }
  return out;
}

std::string obj(const Surface& surface) {
  std::ostringstream out;
  out.precision(9);
  for (const auto& p : surface.vertices.colwise()) out << "v " << p.transpose() << "\n";
  for (const auto& t : surface.triangles.colwise()) {
    out << "f " << (t.array() + 1).transpose() << "\n";
  }
  return out.str();
}

TEST_F(SurfaceFile, EveryFormatGivesTheSameClosedSurface) {
  // Binary fractions survive the float of STL and PLY.
  const Surface box = shapes::box({-1.5, 2.25, 3.0}, {0.5, 4.0, 8.0});
  const double volume = 2.0 * 1.75 * 5.0;
  write_surface(box, folder_ / "d.vtp");
  for (const fs::path& path : {write("a.stl", ascii_stl(box)), write("b.STL", binary_stl(box)),
                               write("c.ply", ascii_ply(box)), write("f.ply", binary_ply(box)),
                               folder_ / "d.vtp", write("e.obj", obj(box))}) {
    SCOPED_TRACE(path);
    const Surface read = read_surface(path, "mm", "LPS").surface;
    const SurfaceCheck check = check_surface(read);
    EXPECT_TRUE(is_sound(check));
    EXPECT_EQ(check.vertices, 8);
    EXPECT_EQ(check.triangles, 12);
    EXPECT_NEAR(check.volume_mm3, volume, 1e-12);
    EXPECT_EQ(read.vertices.rowwise().minCoeff(), Vec3(-1.5, 2.25, 3.0));
  }
}

TEST_F(SurfaceFile, PolygonsAreCutIntoTriangles) {
  const fs::path path = write("cube.obj",
                              "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\n"
                              "v 1 1 1\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\n"
                              "f 2 4 8 6\n");
  const SurfaceCheck check = check_surface(read_surface(path, "mm", "LPS").surface);
  EXPECT_TRUE(is_sound(check));
  EXPECT_EQ(check.triangles, 12);
}

TEST_F(SurfaceFile, InwardNormalsAreTurnedOutward) {
  const fs::path path =
      write("in.stl", ascii_stl(shapes::inside_out(shapes::box({0, 0, 0}, {1, 2, 3}))));
  const SurfaceCheck check = check_surface(read_surface(path, "mm", "LPS").surface);
  EXPECT_TRUE(is_sound(check));
  EXPECT_NEAR(check.volume_mm3, 6.0, 1e-12);
}

TEST_F(SurfaceFile, NormalsThatDisagreeAreMadeToAgree) {
  Surface mixed = shapes::sphere({0, 0, 0}, 3.0, 1.0);
  for (Eigen::Index t = 0; t < mixed.triangles.cols(); t += 3) {
    std::swap(mixed.triangles(0, t), mixed.triangles(1, t));
  }
  ASSERT_GT(check_surface(mixed).misoriented_edges, 0);
  EXPECT_TRUE(
      is_sound(check_surface(read_surface(write("m.obj", obj(mixed)), "mm", "LPS").surface)));
}

TEST_F(SurfaceFile, UnitIsScaledToMillimetres) {
  const fs::path path = write("m.stl", ascii_stl(shapes::box({0, 0, 0}, {0.25, 0.5, 1})));
  EXPECT_EQ(read_surface(path, "m", "LPS").surface.vertices.rowwise().maxCoeff(),
            Vec3(250, 500, 1000));
  EXPECT_EQ(read_surface(path, "cm", "LPS").surface.vertices.rowwise().maxCoeff(),
            Vec3(2.5, 5, 10));
}

TEST_F(SurfaceFile, RasFrameHasItsFirstTwoAxesTurned) {
  const fs::path path = write("ras.stl", ascii_stl(shapes::box({1, 2, 3}, {2, 4, 6})));
  const Surface read = read_surface(path, "mm", "RAS").surface;
  EXPECT_EQ(read.vertices.rowwise().minCoeff(), Vec3(-2, -4, 3));
  EXPECT_TRUE(is_sound(check_surface(read)));  // a turn, no mirror: still outward
}

TEST_F(SurfaceFile, TheVesselIsKeptAndCrumbsAreDropped) {
  const Surface vessel = shapes::straight_tube(2.0, 10.0, 1.0);
  const Surface crumb = shapes::box({10, 10, 10}, {11, 11, 11});
  const Surface read =
      read_surface(write("two.obj", obj(shapes::joined(crumb, vessel))), "mm", "LPS").surface;
  EXPECT_EQ(read.triangles.cols(), vessel.triangles.cols());
}

TEST_F(SurfaceFile, WhatIsNoSurfaceIsRefusedWithItsName) {
  const auto refused = [](const fs::path& path) {
    return message_of([&] { read_surface(path, "mm", "LPS"); });
  };
  EXPECT_NE(refused(folder_ / "absent.stl").find("absent.stl: no such file"), std::string::npos);
  EXPECT_NE(refused(folder_).find("no such file"), std::string::npos);
  EXPECT_NE(refused(write("x.dat", "abc")).find("\".dat\" is not known"), std::string::npos);
  for (const char* name : {"text.stl", "text.ply", "text.obj", "text.vtp"}) {
    for (const char* content : {"", "no surface at all\n"}) {
      const std::string message = refused(write(name, content));
      EXPECT_NE(message.find(name), std::string::npos) << message;
      EXPECT_NE(message.find("expected"), std::string::npos) << message;
    }
  }
  EXPECT_NE(refused(write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")).find("vertex 8"),
            std::string::npos);
  for (const char* face : {"f 1/ 2 ]3", "f 1 2", "f 0 1 2", "f -4 1 2", "f 1 2 3x"}) {
    EXPECT_NE(refused(write("face.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\n") + face + "\n"))
                  .find("(line 4)"),
              std::string::npos)
        << face;
  }
  EXPECT_NE(refused(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")).find("no triangles"),
            std::string::npos);
}

TEST_F(SurfaceFile, ABinaryStlThatPromisesMoreTrianglesThanItHoldsTakesNoMemoryForThem) {
  std::string bytes(84 + 50, '\0');
  bytes.replace(80, 4, "\xff\xff\xff\x7f");  // 2^31 - 1 triangles, 100 GB
  const fs::path file = write("promise.stl", bytes);
  EXPECT_EQ(
      message_of([&] { read_surface(file, "mm", "LPS"); }),
      file.string() +
          ": a binary STL of 134 bytes, expected 107374182434 for the 2147483647 triangles of "
          "its header; copy or export the surface again");
}

TEST_F(SurfaceFile, AnStlIsReadWhateverItsHeaderHolds) {
  const Surface box = shapes::box({0, 0, 0}, {1, 2, 4});
  std::string text = ascii_stl(box), binary = binary_stl(box);
  text.replace(
      0, 10,
      "solid \xe5\xb7\xa6\xe9\xa2\x88\xe5\x86\x85\xe5\x8a\xa8\xe8\x84\x89\xe8\xa1\x80\xe7\xae\xa1");
  binary.replace(0, 10, "solid test");
  std::string old = text, both = text;  // lines that end as on old Macs and on Windows
  std::replace(old.begin(), old.end(), '\n', '\r');
  for (std::size_t at = 0; (at = both.find('\n', at)) != std::string::npos; at += 2) {
    both.insert(at, "\r");
  }
  for (const fs::path& path :
       {write("name.stl", text), write("solid.stl", binary),
        write("behind.stl", binary_stl(box) + "more"), write("both.stl", binary + "xy"),
        write("mark.stl", "\xef\xbb\xbf" + text), write("cr.stl", old), write("crlf.stl", both)}) {
    const Surface read = read_triangles(path, "mm", "LPS");
    EXPECT_EQ(read.triangles.cols(), box.triangles.cols()) << path;
    EXPECT_NEAR(signed_volume(read), 8.0, 1e-12) << path;
  }
  const std::string cut = text.substr(0, text.size() / 2);
  EXPECT_NE(
      message_of([&] { read_triangles(write("cut.stl", cut), "mm", "LPS"); }).find("breaks off"),
      std::string::npos);
}

TEST_F(SurfaceFile, AMarkOfUtf8BeforeTheTextIsNoPartOfIt) {
  const Surface box = shapes::box({0, 0, 0}, {1, 2, 4});
  const std::string mark = "\xef\xbb\xbf", vertices_first = obj(box);
  ASSERT_TRUE(vertices_first.starts_with("v "));  // which would be passed over with the mark
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    return message_of([&] { read_triangles(write(name, bytes), "mm", "LPS"); });
  };
  for (const auto& [name, text] :
       std::vector<std::pair<std::string, std::string>>{{"a.obj", vertices_first},
                                                        {"b.ply", ascii_ply(box)},
                                                        {"c.ply", binary_ply(box)},
                                                        {"d.stl", ascii_stl(box)}}) {
    const Surface read = read_triangles(write(name, mark + text), "mm", "LPS");
    EXPECT_EQ(read.triangles.cols(), box.triangles.cols()) << name;
    EXPECT_NEAR(signed_volume(read), 8.0, 1e-12) << name;
    std::string wide = "\xff\xfe";
    for (const char c : text) wide += {c, '\0'};
    for (const auto& [bytes, why] :
         {std::pair("\x1f\x8b\x08" + text, "is packed by gzip"),
          std::pair("PK\x03\x04" + text, "is packed by zip"), std::pair(wide, "is UTF-16 text")}) {
      EXPECT_NE(refusal(name, bytes).find(name + ": " + why), std::string::npos) << name << why;
    }
  }
}

TEST_F(SurfaceFile, ABinaryStlThatIsCutOrCountsNoneIsToldAsSuchThoughItsHeaderSaysSolid) {
  const Surface box = shapes::box({0, 0, 0}, {1, 2, 4});
  std::string bytes = binary_stl(box);
  bytes.replace(0, 10, "solid name");
  EXPECT_NE(message_of([&] {
              read_triangles(write("cut.stl", bytes.substr(0, 300)), "mm", "LPS");
            }).find("cut.stl: a binary STL of 300 bytes, expected 684 for the 12 triangles"),
            std::string::npos);
  bytes.replace(80, 4, 4, '\0');
  EXPECT_NE(message_of([&] {
              read_triangles(write("none.stl", bytes), "mm", "LPS");
            }).find("none.stl: a binary STL of 684 bytes, expected 84 for the 0 triangles"),
            std::string::npos);
}

TEST_F(SurfaceFile, WhatLiesBehindTheTrianglesOfAnStlIsNoneOfThem) {
  const Surface box = shapes::box({0, 0, 0}, {1, 2, 4});
  const std::string more = binary_stl(shapes::box({500, 500, 500}, {600, 600, 600})).substr(84);
  for (const std::string& behind :
       {std::string(400, '\0'), more, "written by a scanner\n" + std::string(200, 'x'),
        std::string("\nvertex 9 9 9\nvertex 9 8 9\nendfacet\n"), std::string("facet\0\xff", 7)}) {
    for (const fs::path& path : {write("binary.stl", binary_stl(box) + behind),
                                 write("text.stl", ascii_stl(box) + behind)}) {
      const Surface read = read_triangles(path, "mm", "LPS");
      EXPECT_EQ(read.triangles.cols(), box.triangles.cols()) << path << behind.size();
      EXPECT_EQ(read.vertices.cols(), box.vertices.cols()) << path << behind.size();
      EXPECT_EQ(read.vertices.rowwise().maxCoeff(), Vec3(1, 2, 4)) << path << behind.size();
    }
  }
  // Several solids in one file are all of it, and the last of them may break off.
  const Surface other = shapes::box({5, 0, 0}, {6, 2, 4});
  const std::string two = ascii_stl(box) + ascii_stl(other);
  EXPECT_EQ(read_triangles(write("two.stl", two), "mm", "LPS").triangles.cols(), 24);
  const std::string cut = two.substr(0, two.rfind("endsolid"));
  EXPECT_NE(
      message_of([&] { read_triangles(write("cut.stl", cut), "mm", "LPS"); }).find("breaks off"),
      std::string::npos);
}

TEST_F(SurfaceFile, LinesMayEndAsOnAnySystem) {
  const Surface box = shapes::box({0, 0, 0}, {1, 2, 4});
  std::string binary = binary_ply(box);  // with a byte of data that is a line's end behind it
  const std::size_t head = binary.find("end_header\n") + 11;
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"a.obj", obj(box)}, {"b.ply", ascii_ply(box)}, {"c.ply", binary}}) {
    for (const std::string& end : {std::string("\r"), std::string("\r\n")}) {
      SCOPED_TRACE(name + (end == "\r" ? " CR" : " CRLF"));
      std::string changed = text;
      for (std::size_t at = 0; (at = changed.find('\n', at)) != std::string::npos;
           at += end.size()) {
        if (name == "c.ply" && at >= head + 20) break;
        changed.replace(at, 1, end);
      }
      EXPECT_NEAR(signed_volume(read_triangles(write(name, changed), "mm", "LPS")), 8.0, 1e-12);
    }
  }
}

TEST_F(SurfaceFile, TheFrameThatAFileTellsIsFound) {
  for (const char* ras : {"ras", "RAS", "right-anterior-superior", "Right-Anterior-Superior"}) {
    EXPECT_EQ(told_frame(write("r.obj", std::string("# Space=") + ras + "\nv 0 0 0\n")), "RAS")
        << ras;
  }
  EXPECT_EQ(told_frame(write("l.ply", "ply\ncomment SPACE=LPI\n")), "LPI");
  EXPECT_EQ(told_frame(write("s.stl", "solid x SPACE=scanner-xyz;\n")), "SCANNER-XYZ");
  EXPECT_EQ(told_frame(write("n.obj", "# namespace=ras, space=lps\n")), "LPS");

  EXPECT_EQ(told_frame(write("a.stl", "solid 3D Slicer output. SPACE=RAS\n")), "RAS");
  EXPECT_EQ(told_frame(write("a.ply", "ply\nformat ascii 1.0\ncomment SPACE=LPS\n")), "LPS");
  for (const std::string& frame : {std::string("RAS"), std::string("LPS")}) {
    std::string codes;
    for (const char c : frame) codes += std::to_string(int{c}) + " ";
    const auto array = [](const std::string& name, const std::string& type,
                          const std::string& values) {
      return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" NumberOfComponents=\"" +
             (name == "Points" ? "3" : "1") + "\" format=\"ascii\">" + values + "</DataArray>";
    };
    const std::string text =
        "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"><PolyData>"
        "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">" +
        codes +
        "0</Array></FieldData><Piece NumberOfPoints=\"3\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
        "NumberOfStrips=\"0\" NumberOfPolys=\"1\"><Points>" +
        array("Points", "Float64", "0 0 0 1 0 0 0 1 0") + "</Points><Polys>" +
        array("connectivity", "Int64", "0 1 2") + array("offsets", "Int64", "3") +
        "</Polys></Piece></PolyData></VTKFile>";
    EXPECT_EQ(told_frame(write("a.vtp", text)), frame);
  }
  EXPECT_EQ(told_frame(write("b.vtp", "<VTKFile/>")), "");
  EXPECT_EQ(told_frame(write("b.obj", "# SPACE=MARS\nv 0 0 0\n")), "");
  EXPECT_EQ(told_frame(folder_ / "absent.stl"), "");
}

TEST_F(SurfaceFile, UnknownUnitAndFrameAreRefused) {
  const fs::path path = write("box.stl", ascii_stl(shapes::box({0, 0, 0}, {1, 1, 1})));
  EXPECT_NE(message_of([&] { read_surface(path, "inch", "LPS"); }).find("expected mm, cm or m"),
            std::string::npos);
  EXPECT_NE(message_of([&] { read_surface(path, "mm", "RAI"); }).find("expected LPS or RAS"),
            std::string::npos);
}

TEST_F(SurfaceFile, ATruncatedFileIsRefusedOrFoundUnsound) {
  const Surface sphere = shapes::sphere({0, 0, 0}, 3.0, 1.5);
  write_surface(sphere, folder_ / "whole.vtp");
  std::ostringstream vtp;
  vtp << std::ifstream(folder_ / "whole.vtp", std::ios::binary).rdbuf();
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.stl", ascii_stl(sphere)},  {"b.stl", binary_stl(sphere)}, {"c.ply", ascii_ply(sphere)},
      {"f.ply", binary_ply(sphere)}, {"d.obj", obj(sphere)},        {"e.vtp", vtp.str()}};
  for (const auto& file : files) {
    const std::string &name = file.first, &content = file.second;
    // Up to the last cut but the end itself, where only closing words may be missing.
    for (int part = 0; part < 10; ++part) {
      SCOPED_TRACE(name + " cut at " + std::to_string(part) + "/10");
      const fs::path path = write(name, content.substr(0, content.size() * part / 10));
      EXPECT_NE(message_of([&] {
                  require_sound(check_surface(read_surface(path, "mm", "LPS").surface), name);
                }),
                "no error");
    }
  }
}

}  // namespace
}  // namespace wireplan::preprocess
