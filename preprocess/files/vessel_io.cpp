#include "preprocess/files/vessel_io.h"

#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkPointData.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <array>
#include <charconv>
#include <fstream>
#include <sstream>
#include <string_view>

#include "preprocess/surface/vtk_mesh.h"

namespace wireplan::preprocess {
namespace {

// ---- Values into VTK -------------------------------------------------------------------------

vtkSmartPointer<vtkPoints> vtk_points(const Eigen::Matrix3Xd& points) {
  vtkNew<vtkPoints> result;
  result->SetDataTypeToDouble();
  result->SetNumberOfPoints(points.cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) result->SetPoint(k, points.col(k).data());
  return result;
}

vtkSmartPointer<vtkDoubleArray> vtk_array(const std::string& name,
                                          const Eigen::Ref<const Eigen::VectorXd>& values) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  for (const double value : values) array->InsertNextValue(value);
  return array;
}

/// Adds arrays of `count` values each.
void add_arrays(vtkFieldData* fields, const std::vector<NamedArray>& arrays, Eigen::Index count) {
  for (const NamedArray& array : arrays) {
    expects(array.values.size() == static_cast<std::size_t>(count));
    fields->AddArray(vtk_array(array.name, Eigen::VectorXd::Map(array.values.data(), count)));
  }
}

vtkSmartPointer<vtkPolyData> vtk_polyline(const Eigen::Matrix3Xd& points) {
  vtkNew<vtkPolyData> data;
  data->SetPoints(vtk_points(points));
  vtkNew<vtkCellArray> cells;
  data->SetLines(cells);
  if (points.cols() < 2) return data;  // no line: VTK ends the process on one of a point
  cells->InsertNextCell(static_cast<int>(points.cols()));
  for (Eigen::Index k = 0; k < points.cols(); ++k) cells->InsertCellPoint(k);
  return data;
}

/// 3D Slicer reads the field SPACE, and takes a file without it for RAS or LPS by its own setting.
void mark_as_lps(vtkDataObject* data) {
  vtkNew<vtkStringArray> space;
  space->SetName("SPACE");
  space->InsertNextValue("LPS");
  data->GetFieldData()->AddArray(space);
}

void write_bytes(std::string_view bytes, const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) {
    throw DiskError(path.string() +
                    ": cannot be written; check that the folder exists, may be written to and that "
                    "the disk is not full");
  }
}

/// By way of memory: to a file VTK writes in hundreds of small parts.
template <typename Writer>
void write_with(vtkDataObject* data, const std::filesystem::path& path) {
  mark_as_lps(data);
  vtkNew<Writer> writer;
  writer->WriteToOutputStringOn();
  writer->SetInputData(data);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetByteOrderToLittleEndian();
  expects(writer->Write() == 1);
  write_bytes(writer->GetOutputString(), path);
}

// ---- Values out of VTK -----------------------------------------------------------------------

template <typename Reader>
auto read_with(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) throw Error(path.string() + ": no such file");
  const VtkErrors errors;
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  if (errors.any()) {
    throw Error(path.string() + ": is damaged (" + errors.text() + "); make it again");
  }
  return vtkSmartPointer(reader->GetOutput());
}

Eigen::Matrix3Xd points_of(vtkPointSet* data) {
  Eigen::Matrix3Xd points(3, data->GetNumberOfPoints());
  for (Eigen::Index k = 0; k < points.cols(); ++k) data->GetPoint(k, points.col(k).data());
  return points;
}

/// The array of that name with `count` values.
Eigen::VectorXd values_of(vtkFieldData* fields, const std::string& name, Eigen::Index count,
                          const std::filesystem::path& path) {
  vtkDataArray* array = fields->GetArray(name.c_str());
  if (!array || array->GetNumberOfComponents() != 1 || array->GetNumberOfTuples() != count) {
    throw Error(path.string() + ": has no array " + name + " of " + std::to_string(count) +
                " values; expected a file that wireplan wrote");
  }
  Eigen::VectorXd values(count);
  for (Eigen::Index k = 0; k < count; ++k) values(k) = array->GetComponent(k, 0);
  return values;
}

std::string xml_escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// Shortest text that reads back as the same number.
std::string shortest(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace

void write_surface(const Surface& surface, const std::filesystem::path& path) {
  vtkNew<vtkCellArray> cells;
  for (const auto& triangle : surface.triangles.colwise()) {
    cells->InsertNextCell({triangle(0), triangle(1), triangle(2)});
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(vtk_points(surface.vertices));
  data->SetPolys(cells);
  write_with<vtkXMLPolyDataWriter>(data, path);
}

Surface read_surface_artifact(const std::filesystem::path& path) {
  const vtkSmartPointer<vtkPolyData> data = read_with<vtkXMLPolyDataReader>(path);
  if (data->GetNumberOfPolys() == 0 || data->GetPolys()->IsHomogeneous() != 3) {
    throw Error(path.string() + ": holds something else than triangles; expected surface.vtp");
  }
  return surface_from(data);
}

void write_polyline(const Eigen::Matrix3Xd& points, const std::vector<NamedArray>& arrays,
                    const std::filesystem::path& path) {
  const vtkSmartPointer<vtkPolyData> data = vtk_polyline(points);
  add_arrays(data->GetPointData(), arrays, points.cols());
  write_with<vtkXMLPolyDataWriter>(data, path);
}

void write_centerline(const Centerline& line, const std::filesystem::path& path) {
  const auto values = [](const Eigen::VectorXd& v) {
    return std::vector<double>(v.begin(), v.end());
  };
  write_polyline(line.points,
                 {{"radius_mm", values(line.radius)}, {"arc_length_mm", values(line.arc_length)}},
                 path);
}

void write_centerlines(const std::vector<Centerline>& lines, const std::filesystem::path& path) {
  Eigen::Index count = 0;
  for (const Centerline& line : lines) count += line.points.cols();
  Eigen::Matrix3Xd points(3, count);
  Eigen::VectorXd radius(count), arc(count), branch(static_cast<Eigen::Index>(lines.size()));
  vtkNew<vtkCellArray> cells;
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const Eigen::Index n = lines[k].points.cols();
    points.middleCols(at, n) = lines[k].points;
    radius.segment(at, n) = lines[k].radius;
    arc.segment(at, n) = lines[k].arc_length;
    branch(static_cast<Eigen::Index>(k)) = static_cast<double>(k);
    cells->InsertNextCell(static_cast<int>(n));
    for (Eigen::Index i = 0; i < n; ++i) cells->InsertCellPoint(at + i);
    at += n;
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(vtk_points(points));
  data->SetLines(cells);
  data->GetPointData()->AddArray(vtk_array("radius_mm", radius));
  data->GetPointData()->AddArray(vtk_array("arc_length_mm", arc));
  data->GetCellData()->AddArray(vtk_array("branch", branch));
  write_with<vtkXMLPolyDataWriter>(data, path);
}

Centerline read_centerline(const std::filesystem::path& path) {
  const vtkSmartPointer<vtkPolyData> data = read_with<vtkXMLPolyDataReader>(path);
  Centerline line;
  line.points = points_of(data);
  line.radius = values_of(data->GetPointData(), "radius_mm", line.points.cols(), path);
  line.arc_length = values_of(data->GetPointData(), "arc_length_mm", line.points.cols(), path);
  return line;
}

std::vector<Centerline> read_centerlines(const std::filesystem::path& path) {
  const vtkSmartPointer<vtkPolyData> data = read_with<vtkXMLPolyDataReader>(path);
  const Eigen::Matrix3Xd points = points_of(data);
  const Eigen::VectorXd radius = values_of(data->GetPointData(), "radius_mm", points.cols(), path),
                        arc = values_of(data->GetPointData(), "arc_length_mm", points.cols(), path);
  std::vector<Centerline> lines;
  vtkNew<vtkIdList> ids;
  for (vtkIdType k = 0; k < data->GetNumberOfLines(); ++k) {
    data->GetLines()->GetCellAtId(k, ids);
    const std::vector<vtkIdType> at(ids->begin(), ids->end());
    lines.push_back({points(Eigen::all, at), radius(at), arc(at)});
  }
  return lines;
}

void write_wall(const Surface& surface, const Wall& wall, const std::filesystem::path& path,
                const std::vector<NamedArray>& arrays) {
  const Eigen::Index vertices = surface.vertices.cols(), count = surface.triangles.cols();
  expects(wall.apexes.cols() == count && wall.height.size() == count);
  Eigen::Matrix3Xd points(3, vertices + count);
  points << surface.vertices, wall.apexes;
  vtkNew<vtkCellArray> cells;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector3i t = surface.triangles.col(k);
    cells->InsertNextCell({t(0), t(1), t(2), vertices + k});
  }
  vtkNew<vtkUnstructuredGrid> data;
  data->SetPoints(vtk_points(points));
  data->SetCells(VTK_TETRA, cells);
  data->GetCellData()->AddArray(vtk_array("height_mm", wall.height));
  add_arrays(data->GetCellData(), arrays, count);
  data->GetFieldData()->AddArray(
      vtk_array("young_modulus_mpa", Eigen::VectorXd::Constant(1, wall.young_modulus)));
  data->GetFieldData()->AddArray(
      vtk_array("poisson_ratio", Eigen::VectorXd::Constant(1, wall.poisson_ratio)));
  write_with<vtkXMLUnstructuredGridWriter>(data, path);
}

Wall read_wall(const std::filesystem::path& path) {
  const vtkSmartPointer<vtkUnstructuredGrid> data = read_with<vtkXMLUnstructuredGridReader>(path);
  const Eigen::Index count = data->GetNumberOfCells();
  if (count > data->GetNumberOfPoints()) {
    throw Error(path.string() + ": has fewer points than tetrahedra; expected wall.vtu");
  }
  Wall wall;
  wall.apexes = points_of(data).rightCols(count);
  wall.height = values_of(data->GetCellData(), "height_mm", count, path);
  wall.young_modulus = values_of(data->GetFieldData(), "young_modulus_mpa", 1, path)(0);
  wall.poisson_ratio = values_of(data->GetFieldData(), "poisson_ratio", 1, path)(0);
  return wall;
}

std::vector<double> read_wall_array(const std::filesystem::path& path, const std::string& name) {
  const vtkSmartPointer<vtkUnstructuredGrid> data = read_with<vtkXMLUnstructuredGridReader>(path);
  const Eigen::VectorXd values =
      values_of(data->GetCellData(), name, data->GetNumberOfCells(), path);
  return {values.begin(), values.end()};
}

void write_time_series(const std::vector<std::filesystem::path>& files,
                       const std::vector<double>& times, const std::filesystem::path& path) {
  expects(files.size() == times.size());
  std::ostringstream out;
  out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
  for (std::size_t k = 0; k < files.size(); ++k) {
    const std::filesystem::path file =
        std::filesystem::proximate(files[k], std::filesystem::absolute(path).parent_path());
    out << "<DataSet timestep=\"" << shortest(times[k]) << "\" file=\""
        << xml_escaped(file.generic_string()) << "\"/>\n";
  }
  out << "</Collection>\n</VTKFile>\n";
  write_bytes(out.str(), path);
}

}  // namespace wireplan::preprocess
