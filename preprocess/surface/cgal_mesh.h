#pragma once
/// Surface <-> CGAL's half-edge mesh, for the .cpp files here that call CGAL; not for other
/// folders.
#include "preprocess/surface/cgal_mend.h"
#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// Expects a manifold, consistently oriented surface (it may be open).
inline CgalMesh cgal_mesh_from(const Surface& surface) {
  using Vertex = CgalMesh::Vertex_index;
  CgalMesh mesh;
  for (const auto& p : surface.vertices.colwise()) mesh.add_vertex({p.x(), p.y(), p.z()});
  for (const auto& t : surface.triangles.colwise()) {
    const CgalMesh::Face_index face =
        mesh.add_face(Vertex(CgalMesh::size_type(t(0))), Vertex(CgalMesh::size_type(t(1))),
                      Vertex(CgalMesh::size_type(t(2))));
    expects(face != CgalMesh::null_face());
  }
  return mesh;
}

/// The mesh must hold triangles alone; removed elements may still lie in it.
inline Surface surface_from(const CgalMesh& mesh) {
  Surface surface;
  surface.vertices.resize(3, mesh.number_of_vertices());
  std::vector<int> number(mesh.num_vertices(), -1);  // counts removed ones too
  int count = 0;
  for (const CgalMesh::Vertex_index v : mesh.vertices()) {
    const CgalKernel::Point_3& p = mesh.point(v);
    surface.vertices.col(count) << p.x(), p.y(), p.z();
    number[v] = count++;
  }
  surface.triangles.resize(3, mesh.number_of_faces());
  int column = 0;
  for (const CgalMesh::Face_index f : mesh.faces()) {
    int k = 0;
    for (const CgalMesh::Vertex_index v : mesh.vertices_around_face(mesh.halfedge(f))) {
      surface.triangles(k++, column) = number[v];
    }
    ++column;
  }
  return surface;
}

}  // namespace wireplan::preprocess
