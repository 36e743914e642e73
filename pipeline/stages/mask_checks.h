#pragma once
/// What is asked and told of a mask before a surface is made of it, whether a volume was segmented
/// or labels were given.
#include <cstddef>
#include <vector>

#include "pipeline/files/case_file.h"
#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment_touch.h"

namespace wireplan::pipeline {

/// How far beside a mask an access or a target may lie: the surface may hold it still [mm].
double reach_beside(const preprocess::Grid& grid);

/// Refuses a mask outside of which an access or a target lies, or whose pieces part them; all that
/// is wrong is told. Takes away all but the piece that holds them where another one is larger,
/// which would become the surface, tells that, and returns whether it did.
bool require_ends_in_one_piece(const Case& given, preprocess::Mask& mask, Json& figures);

/// Counts of the mask, as figures.
void add_shape(const preprocess::MaskShape& shape, Json& figures);

/// Touches, the first `dipping` of them found by their values: as figures, and as warnings with
/// their places and what to do.
void add_touches(const Case& given, const std::vector<preprocess::Touch>& touches,
                 std::size_t dipping, Json& figures);

}  // namespace wireplan::pipeline
