#pragma once
/// Given triangles -> the lumen's surface, closed and oriented, where that is safe; what was mended
/// is told. Nothing here moves the wall by more than the size of what is mended.
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

enum class MendKind {
  kDuplicate,     // triangles that were there twice: dropped
  kDegenerate,    // triangles without area: dropped or collapsed
  kTurned,        // triangles whose normals disagreed with their neighbours': turned
  kInward,        // triangles, all of them, whose normals pointed inward: turned
  kFin,           // sheets hanging on an edge of the wall, or across the lumen: dropped
  kContact,       // parts of the wall that touched in an edge or a point: parted there
  kTangle,        // triangles round edges of several sheets: cut out, and the hole closed
  kHole,          // small holes: closed
  kOpenEnd,       // ends at which the vessel was cut: capped
  kPiece,         // other pieces: dropped
  kUnited,        // closed pieces that overlap the vessel: united with it
  kOuterSkin,     // outside of a wall with two skins: dropped, so that the inner skin is the lumen
  kIntersection,  // triangles that cut each other: made anew
};

/// One thing that was mended.
struct Mend {
  MendKind kind = MendKind::kHole;
  int count = 1;  // triangles; of kContact vertices; of kHole and kOpenEnd edges round it
  Vec3 place = Vec3::Zero();  // its middle, or one of many                                 [mm]
  double size = 0.0;          // width; of kOuterSkin the wall's thickness                  [mm]
};

struct RepairedSurface {
  Surface surface;
  std::vector<Mend> mends;       // in the order in which they were made
  std::vector<Surface> dropped;  // the pieces of MendKind::kPiece, as they were: closed or open
};

/// Repairs triangles as a file holds them (equal points merged). One vessel is kept: the piece of
/// the largest volume with those that overlap it, or the inner skin of a wall that has two. Throws
/// `Error`, naming `origin`, the place [mm] and a remedy, where a repair would be a guess: one side
/// only, a hole too wide, a wall of two skins that cannot be told apart. The result may still be
/// unsound in ways that are not mended here: pass it to `require_sound`.
RepairedSurface repair_surface(const Surface& triangles, const std::string& origin);

/// Reads a file as `read_triangles` does, and repairs it.
RepairedSurface read_surface(const std::filesystem::path& path, const std::string& unit,
                             const std::string& frame);

/// The same; throws `Error` too where the result is not sound.
RepairedSurface read_sound_surface(const std::filesystem::path& path, const std::string& unit,
                                   const std::string& frame);

/// Of a point [mm] outside the vessel that lies in a dropped piece: "lies in a piece of the surface
/// that was dropped", with its place and how far from the vessel it is, and what to do. Empty where
/// it lies in none.
std::string tell_dropped(const std::vector<Surface>& dropped, const Surface& vessel,
                         const Vec3& point);

/// What was mended, one sentence per kind, with numbers, sizes and places [mm] for a person.
std::vector<std::string> tell_mends(const std::vector<Mend>& mends);

/// "hole", "open end", ...: the kind as reports name it.
std::string name_of(MendKind kind);

}  // namespace wireplan::preprocess
